//! Gauss–Newton steps.

use super::report::Termination;
use super::run::{Outcome, Run};
use super::step::damped_decrease;
use crate::GraphError;

impl Run<'_> {
    /// Takes the step of `H δ = −g` whatever it does to the cost.
    pub(super) fn gauss_newton(&mut self) -> Result<Outcome, GraphError> {
        let (problem, limits) = (&*self.problem, &self.limits);
        let solved = self.linear.step(problem, 0.0, self.parallel, &mut self.timings, limits);
        solved.map_err(GraphError::unfactorised)?;
        let before = self.cost;
        let predicted = damped_decrease(&self.problem.matrix.rhs, &self.linear.delta, 0.0);
        let trial = self.try_step(predicted)?;
        if trial.is_infinite() {
            return Ok(Outcome {
                row: self.row(predicted, before, trial, 1),
                stop: Some(Termination::Stalled),
            });
        }
        self.accept(trial, (before - trial) / predicted);
        let row = self.row(predicted, before, trial, 1);
        Ok(Outcome { stop: self.stop(before, predicted, row.step), row })
    }
}
