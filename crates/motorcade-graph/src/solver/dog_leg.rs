//! Powell's dog-leg.

use super::report::Termination;
use super::run::{MAX_TRIALS, Outcome, ROUNDING, Run};
use super::step::{dog_leg, dot, largest};
use crate::GraphError;

impl Run<'_> {
    /// A step inside the trust radius, which shrinks until the cost falls.
    pub(super) fn dog_leg(&mut self) -> Result<Outcome, GraphError> {
        let before = self.cost;
        let (problem, limits) = (&*self.problem, &self.limits);
        let solved = self.linear.step(problem, 0.0, self.parallel, &mut self.timings, limits);
        solved.map_err(GraphError::unfactorised)?;
        let newton = std::mem::take(&mut self.linear.delta);
        let rhs = &self.problem.matrix.rhs;
        // Minimum along −g: δ = (gᵀg / gᵀHg) · (−g)
        let curvature = self.problem.matrix.quadratic_form(rhs);
        let length = if curvature > 0.0 { dot(rhs, rhs) / curvature } else { 0.0 };
        let cauchy: Vec<f64> = rhs.iter().map(|x| x * length).collect();
        let newton_norm = dot(&newton, &newton).sqrt();
        let mut predicted = 0.0;
        for trials in 1..=MAX_TRIALS {
            let mut delta = std::mem::take(&mut self.linear.delta);
            dog_leg(&cauchy, &newton, self.radius, &mut delta);
            let matrix = &self.problem.matrix;
            predicted = 2.0 * dot(&matrix.rhs, &delta) - matrix.quadratic_form(&delta);
            self.linear.delta = delta;
            let trial = self.try_step(predicted)?;
            let gain = (before - trial) / predicted;
            let norm = dot(&self.linear.delta, &self.linear.delta).sqrt();
            let negligible = predicted <= self.options.relative_decrease * before;
            if gain > 1e-4 || (negligible && trial <= before * (1.0 + ROUNDING)) {
                self.accept(trial, gain);
                self.lambda = self.radius.min(newton_norm);
                let row = self.row(predicted, before, trial, trials);
                if gain > 0.75 {
                    self.radius = self.radius.max(3.0 * norm);
                } else if gain < 0.25 {
                    self.radius = 0.5 * norm;
                }
                return Ok(Outcome { stop: self.stop(before, predicted, row.step), row });
            }
            if negligible || largest(&self.linear.delta) <= self.options.step_size {
                let row = self.row(predicted, before, trial, trials);
                return Ok(Outcome { row, stop: Some(Termination::Converged) });
            }
            self.refuse()?;
            self.radius = 0.25 * norm.min(self.radius);
        }
        let row = self.row(predicted, before, before, MAX_TRIALS);
        Ok(Outcome { row, stop: Some(Termination::Stalled) })
    }
}
