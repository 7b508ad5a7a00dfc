//! One solve: linearise, step, accept or refuse, stop.

use std::time::Instant;

use super::limits::Limits;
use super::options::{Control, Method, Options};
use super::problem::{Problem, cost};
use super::report::{Iteration, Report, Termination, Timings};
use super::step::{Linear, largest};
use crate::GraphError;
use crate::graph::Graph;
use crate::values::Values;

/// Steps tried from one linearisation before giving up.
pub(super) const MAX_TRIALS: usize = 30;

/// Relative change of a cost that is noise of its summation. A last small step whose promise drowns in it is taken
/// all the same: the model is then better known than the cost.
pub(super) const ROUNDING: f64 = 1e-12;

/// State of one solve.
pub(super) struct Run<'a> {
    pub options: &'a Options,
    pub graph: &'a Graph,
    pub problem: &'a mut Problem,
    pub linear: &'a mut Linear,
    pub parallel: bool,
    pub values: Values,
    pub trial: Values,
    pub cost: f64,
    pub lambda: f64,
    pub growth: f64,
    /// Last damping of an accepted step.
    pub worked: f64,
    /// Steps in a row that hardly lowered the cost.
    pub quiet: usize,
    /// Decrease predicted for the last undamped step; `None` after a damped or a poor one.
    pub settled: Option<f64>,
    pub radius: f64,
    /// True after an undamped step that went about as promised: the next is likely to be taken.
    pub trusting: bool,
    /// Point of the normal equations.
    pub filled: Filled,
    /// Linearisation at work, from 1.
    pub number: usize,
    pub timings: Timings,
    pub start: Instant,
    pub limits: Limits<'a>,
}

/// The point of the normal equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filled {
    /// Neither point, or not known.
    Elsewhere,
    /// The current values.
    Current,
    /// The trial point.
    Trial,
}

/// Outcome of one linearisation.
pub(super) struct Outcome {
    pub row: Iteration,
    pub stop: Option<Termination>,
}

impl Run<'_> {
    pub fn all(&mut self, control: &Control) -> Result<Report, GraphError> {
        let (mut iterations, mut initial_cost) = (Vec::new(), None);
        let termination = loop {
            if self.problem.variables.is_empty() {
                self.cost = cost(self.graph, &self.values, self.parallel)?;
                break Termination::NothingToDo;
            }
            if iterations.len() >= self.options.max_iterations {
                if iterations.is_empty() {
                    self.cost = cost(self.graph, &self.values, self.parallel)?;
                }
                break Termination::Iterations;
            }
            let outcome = match self.iterate(iterations.len() + 1, &mut initial_cost) {
                // In the middle of an iteration: the values are those of the one before.
                Err(GraphError::Stopped) => break self.limits.reached().unwrap_or(Termination::Cancelled),
                outcome => outcome?,
            };
            if let Some(progress) = &control.progress {
                progress(&outcome.row);
            }
            iterations.push(outcome.row);
            if let Some(reason) = outcome.stop {
                break reason;
            }
            if let Some(reason) = self.limits.reached() {
                break reason;
            }
        };
        self.timings.total_s = self.start.elapsed().as_secs_f64();
        Ok(Report {
            termination,
            initial_cost: initial_cost.unwrap_or(self.cost),
            final_cost: self.cost,
            iterations,
            unknowns: self.problem.matrix.len(),
            factor_scalars: self.problem.matrix.factor_len(),
            factor_multiplications: self.problem.matrix.factor_multiplications(),
            condition: self.linear.factor.condition(),
            timings: self.timings,
        })
    }

    fn iterate(&mut self, number: usize, initial_cost: &mut Option<f64>) -> Result<Outcome, GraphError> {
        self.number = number;
        self.fill()?;
        initial_cost.get_or_insert(self.cost);
        let mut outcome = match self.options.method {
            Method::GaussNewton => self.gauss_newton(),
            Method::LevenbergMarquardt => match self.chord()? {
                Some(outcome) => Ok(outcome),
                None => self.levenberg_marquardt(),
            },
            Method::DogLeg => self.dog_leg(),
        }?;
        outcome.row.iteration = number;
        outcome.row.elapsed_s = self.start.elapsed().as_secs_f64();
        Ok(outcome)
    }

    /// Linearises at the current values unless a step that was taken has done so.
    fn fill(&mut self) -> Result<(), GraphError> {
        if self.filled != Filled::Current {
            let start = Instant::now();
            self.cost = self.problem.linearise(self.graph, &self.values, self.parallel)?;
            self.timings.linearise_s += start.elapsed().as_secs_f64();
            self.filled = Filled::Current;
        }
        if !self.cost.is_finite() || self.problem.matrix.rhs.iter().any(|x| !x.is_finite()) {
            return Err(GraphError::NotFinite);
        }
        Ok(())
    }

    /// Cost at `x ⊞ delta`; infinite where it is not a number. Where the step is likely to be taken and not the last
    /// one, the linearisation there, which needs the same residuals, is computed at once.
    pub fn try_step(&mut self, predicted: f64) -> Result<f64, GraphError> {
        let start = Instant::now();
        self.problem.retract(&self.values, &self.linear.delta, &mut self.trial)?;
        let last = self.number >= self.options.max_iterations
            || predicted <= self.options.relative_decrease * self.cost;
        let trial = if self.trusting && !last {
            self.filled = Filled::Trial;
            let trial = self.problem.linearise(self.graph, &self.trial, self.parallel)?;
            self.timings.linearise_s += start.elapsed().as_secs_f64();
            trial
        } else {
            let trial = cost(self.graph, &self.trial, self.parallel)?;
            self.timings.evaluate_s += start.elapsed().as_secs_f64();
            trial
        };
        Ok(if trial.is_finite() { trial } else { f64::INFINITY })
    }

    pub fn accept(&mut self, cost: f64, gain: f64) {
        std::mem::swap(&mut self.values, &mut self.trial);
        self.cost = cost;
        self.filled = if self.filled == Filled::Trial { Filled::Current } else { Filled::Elsewhere };
        self.trusting = gain > 0.5 && self.lambda == 0.0;
    }

    /// Back to the normal equations of the current values after a step that is not taken.
    pub fn refuse(&mut self) -> Result<(), GraphError> {
        self.trusting = false;
        self.fill()
    }

    /// The stopping rule after a step was taken. `predicted` is what the model promised.
    pub fn stop(&self, before: f64, predicted: f64, step: f64) -> Option<Termination> {
        let small = self.options.relative_decrease * before;
        // A promise this small was kept or not, but the next one will be smaller still.
        if predicted <= small || (before - self.cost).abs() <= small {
            return Some(Termination::Converged);
        }
        (step <= self.options.step_size).then_some(Termination::SmallStep)
    }

    pub fn row(&self, predicted: f64, before: f64, trial: f64, trials: usize) -> Iteration {
        Iteration {
            iteration: 0,
            cost: self.cost,
            lambda: self.lambda,
            gain: if predicted > 0.0 { (before - trial) / predicted } else { 0.0 },
            step: largest(&self.linear.delta),
            trials,
            factorised: true,
            elapsed_s: 0.0,
        }
    }
}
