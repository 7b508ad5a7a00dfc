//! The solves of the graph of a trajectory and its loops.

use motorcade_graph::solver::{Control, GraduateOptions, Solver, graduate_unless};
use motorcade_graph::{Graph, GraphError, GroupId, Options, Stop};

use crate::options::GraphOptions;

/// Settings of the solves of [`close_loops`](super::close_loops).
#[derive(Clone, Copy)]
pub struct LoopSolve<'a> {
    /// Noise of the steps, and limits of the solver.
    pub graph: &'a GraphOptions,
    /// Mean interval of the trajectory's frames \[s\].
    pub interval_s: f64,
    /// Threads; the result does not depend on them.
    pub threads: usize,
    /// A request to give up.
    pub stop: Stop<'a>,
}

impl LoopSolve<'_> {
    pub(super) fn options(&self) -> Options {
        let max_iterations = self.graph.advanced.max_iterations;
        Options { max_iterations, threads: self.threads, ..Options::default() }
    }

    /// Solves to convergence.
    ///
    /// # Errors
    /// Those of the solver; [`GraphError::Stopped`].
    pub(super) fn optimise(&self, graph: &mut Graph) -> Result<(), GraphError> {
        Solver::new(self.options())?.optimise_unless(graph, self.stop)?;
        self.unless_stopped()
    }

    /// Solves with the kernels of a group, convex at first.
    ///
    /// # Errors
    /// Those of the solver; [`GraphError::Stopped`].
    pub(super) fn graduate(
        &self,
        graph: &mut Graph,
        group: GroupId,
        schedule: &GraduateOptions,
    ) -> Result<(), GraphError> {
        graduate_unless(graph, group, &self.options(), schedule, &Control::default(), self.stop)?;
        self.unless_stopped()
    }

    /// An error when asked to stop: the solver then returned what it had by then.
    fn unless_stopped(&self) -> Result<(), GraphError> {
        if self.stop.asked() { Err(GraphError::Stopped) } else { Ok(()) }
    }
}
