//! The solver: keeps pattern, ordering and memory from solve to solve.

use std::time::Instant;

use motorcade_sparse::{SelectedInverse, Stop};
use nalgebra::DMatrix;

use super::limits::Limits;
use super::options::{Control, Options};
use super::problem::Problem;
use super::report::{Report, Timings};
use super::run::{Filled, Run};
use super::step::Linear;
use crate::GraphError;
use crate::graph::Graph;
use crate::ids::VariableId;

/// Factors below which threads cost more than they gain; the result is the same either way.
const WORTH_THREADS: usize = 4096;

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
        self.optimise_unless(graph, Stop::NEVER)
    }

    /// As [`optimise`](Self::optimise); a solve that is asked to stop is cancelled.
    ///
    /// # Errors
    /// As [`optimise`](Self::optimise).
    pub fn optimise_unless(&mut self, graph: &mut Graph, stop: Stop<'_>) -> Result<Report, GraphError> {
        if self.options.threads == 1 || graph.entries().len() < WORTH_THREADS {
            return self.run(graph, false, stop);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.options.threads).build();
        let pool = pool.map_err(|e| GraphError::Threads(e.to_string()))?;
        pool.install(|| self.run(graph, true, stop))
    }

    /// Another number of iterations for the next solve.
    pub(crate) fn set_max_iterations(&mut self, max_iterations: usize) {
        self.options.max_iterations = max_iterations;
    }

    /// Another time limit for the next solve.
    pub(crate) fn set_time_limit_s(&mut self, limit_s: Option<f64>) {
        self.options.time_limit_s = limit_s;
    }

    /// Gives back the memory of the last solve; the next one takes it again.
    pub(crate) fn forget(&mut self) {
        (self.cached, self.linear) = Default::default();
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
        SelectedInverse::diagonal_block(&problem.matrix, &self.linear.factor, block as u32, Stop::NEVER)
    }

    fn run(&mut self, graph: &mut Graph, parallel: bool, stop: Stop<'_>) -> Result<Report, GraphError> {
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
            limits: Limits::new(&self.control, stop, &self.options, start),
        };
        let report = run.all(&self.control)?;
        let values = run.values;
        *graph.values_mut() = values;
        Ok(report)
    }
}
