//! Online use: a window of recent variables, optimised warm, the past kept as a prior.

use std::collections::VecDeque;

use nalgebra::DMatrix;

use crate::GraphError;
use crate::graph::Graph;
use crate::marginalise::marginalise;
use crate::marginals::Marginals;
use crate::solver::{Options, Report, Solver};
use crate::values::VariableId;

/// A graph over the last `lag` frames. Cost and memory of a frame stay the same from start to end of a drive.
///
/// For every frame: add its variables and factors through [`graph_mut`](Self::graph_mut), tell which variables
/// belong to it with [`advance`](Self::advance), then [`optimise`](Self::optimise).
#[derive(Debug)]
pub struct FixedLag {
    graph: Graph,
    solver: Solver,
    lag: usize,
    frames: VecDeque<Vec<VariableId>>,
}

impl FixedLag {
    /// A window of `lag` frames (at least 1). A few iterations a frame suffice from a warm start.
    pub fn new(lag: usize, options: Options) -> Result<Self, GraphError> {
        if lag == 0 {
            return Err(GraphError::Option { name: "lag", reason: "must be at least 1".into() });
        }
        Ok(Self { graph: Graph::new(), solver: Solver::new(options)?, lag, frames: VecDeque::new() })
    }

    /// The graph of the window.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The graph of the window, to add to.
    pub fn graph_mut(&mut self) -> &mut Graph {
        &mut self.graph
    }

    /// Opens a frame with the variables added for it and marginalises the frame that falls out of the window.
    /// Variables never named in a frame stay (a scale, a calibration). Returns the variables that left.
    pub fn advance(&mut self, variables: Vec<VariableId>) -> Result<Vec<VariableId>, GraphError> {
        self.frames.push_back(variables);
        if self.frames.len() <= self.lag {
            return Ok(Vec::new());
        }
        let old = self.frames.pop_front().unwrap_or_default();
        let leaving: Vec<VariableId> =
            old.into_iter().filter(|&id| self.graph.values().value(id).is_ok()).collect();
        marginalise(&mut self.graph, &leaving)?;
        Ok(leaving)
    }

    /// Marginalises variables ahead of their time, for example all of a track that has ended: they are leaves and
    /// only join the cameras that saw them.
    pub fn retire(&mut self, variables: &[VariableId]) -> Result<(), GraphError> {
        marginalise(&mut self.graph, variables).map(|_| ())
    }

    /// Optimises the window from its current values.
    pub fn optimise(&mut self) -> Result<Report, GraphError> {
        self.solver.optimise(&mut self.graph)
    }

    /// Covariance (dof × dof) of one variable of the window, the newest pose for example, given all that was ever
    /// measured up to now. Costs about one iteration of the window, however long the drive.
    pub fn covariance(&self, variable: VariableId) -> Result<DMatrix<f64>, GraphError> {
        Marginals::new(&self.graph)?.covariance(variable)
    }
}
