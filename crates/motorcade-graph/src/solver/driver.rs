//! The loop: linearise, step, judge, stop.

use std::time::Instant;

use nalgebra::DMatrix;

use super::options::{Control, Method, Options};
use super::problem::{Problem, cost};
use super::report::{Iteration, Report, Termination, Timings};
use super::step::{Linear, damped_decrease, dog_leg, dot, largest};
use crate::GraphError;
use crate::graph::Graph;
use crate::sparse::inverse;
use crate::values::{Values, VariableId};

/// Steps tried from one linearisation before giving up.
const MAX_TRIALS: usize = 30;

/// Relative change of a cost that is noise of its summation. A last small step whose promise drowns in it is taken
/// all the same: the model is then better known than the cost.
const ROUNDING: f64 = 1e-12;

/// Factors below which threads cost more than they gain; the result is the same either way.
const WORTH_THREADS: usize = 4096;

/// Gain of a step after which the linearisation counts as good enough to keep its factor.
const AS_PROMISED: std::ops::RangeInclusive<f64> = 0.75..=1.33;

/// Optimises graphs and keeps pattern, ordering and memory for the next solve of the same graph.
#[derive(Debug, Default)]
pub struct Solver {
    options: Options,
    control: Control,
    cached: Option<(u64, Problem)>,
    linear: Linear,
    /// Patterns analysed so far.
    analyses: usize,
}

/// Optimises `graph` in place, once.
pub fn optimise(graph: &mut Graph, options: &Options) -> Result<Report, GraphError> {
    Solver::new(options.clone())?.optimise(graph)
}

/// State of one solve.
struct Run<'a> {
    options: &'a Options,
    graph: &'a Graph,
    problem: &'a mut Problem,
    linear: &'a mut Linear,
    parallel: bool,
    values: Values,
    trial: Values,
    cost: f64,
    lambda: f64,
    growth: f64,
    /// Last damping of an accepted step.
    worked: f64,
    /// Steps in a row that hardly lowered the cost.
    quiet: usize,
    /// What the last undamped step promised; none after a damped or a poor one.
    settled: Option<f64>,
    radius: f64,
    /// True after an undamped step that went about as promised: the next is likely to be taken.
    trusting: bool,
    /// Where the matrix was filled.
    filled: Filled,
    /// Linearisation at work, from 1.
    number: usize,
    timings: Timings,
    start: Instant,
}

/// Where the normal equations are those of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Filled {
    /// Neither point, or not known.
    Elsewhere,
    /// The current values.
    Current,
    /// The trial point.
    Trial,
}

/// What one linearisation led to.
struct Outcome {
    row: Iteration,
    stop: Option<Termination>,
}

impl Solver {
    /// A solver with checked options.
    pub fn new(options: Options) -> Result<Self, GraphError> {
        options.validate()?;
        Ok(Self { options, ..Self::default() })
    }

    /// Adds cancellation and progress.
    #[must_use]
    pub fn with_control(self, control: Control) -> Self {
        Self { control, ..self }
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Optimises `graph` in place. When a limit is hit or the solve is cancelled the best values so far are kept.
    pub fn optimise(&mut self, graph: &mut Graph) -> Result<Report, GraphError> {
        if self.options.threads == 1 || graph.boxed_factors().len() < WORTH_THREADS {
            return self.run(graph, false);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.options.threads).build();
        let pool = pool.map_err(|e| GraphError::Threads(e.to_string()))?;
        pool.install(|| self.run(graph, true))
    }

    /// Another time limit for the next solve.
    pub(crate) fn set_time_limit_s(&mut self, limit_s: Option<f64>) {
        self.options.time_limit_s = limit_s;
    }

    /// Patterns analysed so far: those that were not the one of the solve before.
    #[cfg(test)]
    pub(crate) fn analyses(&self) -> usize {
        self.analyses
    }

    /// Covariance of a variable out of the last factor of the last solve; `None` without an undamped one.
    pub(crate) fn covariance(&self, variable: VariableId) -> Option<DMatrix<f64>> {
        let (_, problem) = self.cached.as_ref().filter(|_| self.linear.undamped)?;
        let block = problem.variables.binary_search(&variable).ok()?;
        Some(inverse::diagonal_block(&problem.matrix.symbolic, &self.linear.factor, block as u32))
    }

    fn run(&mut self, graph: &mut Graph, parallel: bool) -> Result<Report, GraphError> {
        let start = Instant::now();
        let version = graph.version();
        let problem = match &mut self.cached {
            Some((v, problem)) if *v == version => problem,
            cached => {
                let last = cached.take().map(|(_, problem)| problem);
                let problem = Problem::new(graph, last)?;
                if !problem.reused {
                    self.linear = Linear::default();
                    self.analyses += 1;
                }
                &mut cached.insert((version, problem)).1
            }
        };
        self.linear.undamped = false;
        let mut run = Run {
            options: &self.options,
            values: graph.values().clone(),
            trial: graph.values().clone(),
            graph,
            problem,
            linear: &mut self.linear,
            parallel,
            cost: 0.0,
            lambda: 0.0,
            growth: 2.0,
            worked: 0.0,
            quiet: 0,
            settled: None,
            radius: f64::INFINITY,
            trusting: true,
            filled: Filled::Elsewhere,
            number: 0,
            timings: Timings { analyse_s: start.elapsed().as_secs_f64(), ..Timings::default() },
            start,
        };
        let report = run.all(&self.control)?;
        let values = run.values;
        *graph.values_mut() = values;
        Ok(report)
    }
}

impl Run<'_> {
    fn all(&mut self, control: &Control) -> Result<Report, GraphError> {
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
            let outcome = self.iterate(iterations.len() + 1, &mut initial_cost)?;
            if let Some(progress) = &control.progress {
                progress(&outcome.row);
            }
            iterations.push(outcome.row);
            if let Some(reason) = outcome.stop {
                break reason;
            }
            if control.cancelled() {
                break Termination::Cancelled;
            }
            if self.options.time_limit().is_some_and(|limit| self.start.elapsed() >= limit) {
                break Termination::Time;
            }
        };
        self.timings.total_s = self.start.elapsed().as_secs_f64();
        Ok(Report {
            termination,
            initial_cost: initial_cost.unwrap_or(self.cost),
            final_cost: self.cost,
            iterations,
            unknowns: self.problem.matrix.symbolic.len(),
            factor_scalars: self.problem.matrix.symbolic.factor_len,
            factor_multiplications: self.problem.matrix.symbolic.flops,
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
    /// one, the linearisation there, which needs the same residuals, is made at once.
    fn try_step(&mut self, predicted: f64) -> Result<f64, GraphError> {
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

    fn accept(&mut self, cost: f64, gain: f64) {
        std::mem::swap(&mut self.values, &mut self.trial);
        self.cost = cost;
        self.filled = if self.filled == Filled::Trial { Filled::Current } else { Filled::Elsewhere };
        self.trusting = gain > 0.5 && self.lambda == 0.0;
    }

    /// Back to the normal equations of the current values after a step that is not taken.
    fn refuse(&mut self) -> Result<(), GraphError> {
        self.trusting = false;
        self.fill()
    }

    /// The stopping rule after a step was taken. `predicted` is what the model promised.
    fn stop(&self, before: f64, predicted: f64, step: f64) -> Option<Termination> {
        let small = self.options.relative_decrease * before;
        // A promise this small was kept or not, but the next one will be smaller still.
        if predicted <= small || (before - self.cost).abs() <= small {
            return Some(Termination::Converged);
        }
        (step <= self.options.step_size).then_some(Termination::SmallStep)
    }

    fn row(&self, predicted: f64, before: f64, trial: f64, trials: usize) -> Iteration {
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

    fn gauss_newton(&mut self) -> Result<Outcome, GraphError> {
        if !self.linear.step(self.problem, 0.0, self.parallel, &mut self.timings) {
            return Err(GraphError::Singular);
        }
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

    /// A Gauss–Newton step with the last factor in place of a new one (the chord, or Shamanskii, method): near the
    /// minimum H hardly changes, so several such steps cost less than a factorisation. `None` where one is better.
    fn chord(&mut self) -> Result<Option<Outcome>, GraphError> {
        let Some(last) = self.settled.take() else { return Ok(None) };
        let before = self.cost;
        let small = self.options.relative_decrease * before;
        // Each step shrinks the promise by the same factor c: 1 + ln(small / predicted) / ln c steps with c = predicted / last
        // are to cost no more than the factorisation.
        let most = 2.0 + self.problem.factorisation_in_steps();
        let limit = last * (small / last).min(1.0).powf(1.0 / most);
        let Some(predicted) = self.linear.again(self.problem, limit, &mut self.timings) else {
            return Ok(None);
        };
        // Cheap steps, but refused more often: no linearisation on trust.
        let trusting = std::mem::take(&mut self.trusting);
        let trial = self.try_step(predicted)?;
        self.trusting = trusting;
        let gain = (before - trial) / predicted;
        let rounding = predicted <= small && trial <= before * (1.0 + ROUNDING);
        if !rounding && !AS_PROMISED.contains(&gain) {
            return Ok(None);
        }
        self.accept(trial, gain);
        self.settled = Some(predicted);
        let row = Iteration { factorised: false, ..self.row(predicted, before, trial, 1) };
        Ok(Some(Outcome { stop: self.stop(before, predicted, row.step), row }))
    }

    fn levenberg_marquardt(&mut self) -> Result<Outcome, GraphError> {
        let before = self.cost;
        let highest = self.problem.matrix.diagonal().fold(f64::MIN_POSITIVE, f64::max);
        let floor = self.options.initial_lambda * highest;
        let mut predicted = 0.0;
        for trials in 1..=MAX_TRIALS {
            if self.linear.step(self.problem, self.lambda, self.parallel, &mut self.timings) {
                predicted = damped_decrease(&self.problem.matrix.rhs, &self.linear.delta, self.lambda);
                let trial = self.try_step(predicted)?;
                let gain = (before - trial) / predicted;
                let negligible = predicted <= self.options.relative_decrease * before;
                if gain > 1e-4 || (negligible && trial <= before * (1.0 + ROUNDING)) {
                    self.accept(trial, gain);
                    self.settled = (self.lambda == 0.0 && AS_PROMISED.contains(&gain)).then_some(predicted);
                    let row = self.row(predicted, before, trial, trials);
                    return Ok(Outcome { stop: self.relax(before, predicted, gain, row.step, floor), row });
                }
                if negligible || largest(&self.linear.delta) <= self.options.step_size {
                    let row = self.row(predicted, before, trial, trials);
                    return Ok(Outcome { row, stop: Some(Termination::Converged) });
                }
                self.refuse()?;
            }
            // A failed Gauss–Newton step falls back to the damping that worked last.
            let least = if self.lambda == 0.0 { self.worked.max(1e-3 * floor) } else { floor * 1e-3 };
            self.lambda = (self.lambda * self.growth).max(least);
            self.growth *= 2.0;
            if !self.lambda.is_finite() || self.lambda > 1e12 * highest {
                break;
            }
        }
        let row = self.row(predicted, before, before, MAX_TRIALS);
        Ok(Outcome { row, stop: Some(Termination::Stalled) })
    }

    /// Lowers the damping after a good step and decides whether to stop. A small decrease under damping says little:
    /// the damping may be what keeps the step short, so it takes several of them, with ever less damping.
    fn relax(
        &mut self,
        before: f64,
        predicted: f64,
        gain: f64,
        step: f64,
        floor: f64,
    ) -> Option<Termination> {
        let stop = self.stop(before, predicted, step);
        let damped = self.lambda > 0.0;
        self.growth = 2.0;
        if damped {
            self.worked = self.lambda;
            // Nielsen: shrink by how well the model held; much faster than his third where it held throughout.
            let shrink =
                if gain > 0.9 { 0.1 } else { (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0) };
            self.lambda *= if stop.is_some() { 0.01 } else { shrink };
            if self.lambda < 1e-4 * floor {
                self.lambda = 0.0;
            }
        } else {
            self.worked = 0.0;
        }
        self.quiet = if stop.is_some() { self.quiet + 1 } else { 0 };
        stop.filter(|_| !damped || self.quiet >= 4)
    }

    fn dog_leg(&mut self) -> Result<Outcome, GraphError> {
        let before = self.cost;
        if !self.linear.step(self.problem, 0.0, self.parallel, &mut self.timings) {
            return Err(GraphError::Singular);
        }
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
