//! The edge of a loop.

use motorcade_geometry::{Camera, Pose};
use motorcade_graph::factors::Between;
use motorcade_graph::{GraphError, VariableId};
use nalgebra::Matrix6;

use super::options::LoopOptions;
use crate::edges::inverse;

/// A relative pose of two frames that see the same place.
#[derive(Clone, Debug)]
pub struct LoopEdge {
    /// The earlier frame.
    pub earlier: usize,
    /// The later frame.
    pub later: usize,
    /// The later camera from the earlier one \[m\].
    pub later_from_earlier: Pose<Camera, Camera>,
    /// Its covariance (6×6 `[ω, ν]`, right perturbation).
    pub covariance: Matrix6<f64>,
}

impl LoopEdge {
    /// The covariance with the errors that neighbouring edges share and those that no pixel tells.
    pub(crate) fn inflated(&self, options: &LoopOptions) -> Matrix6<f64> {
        let [turn, place] = [options.least_sigma_rad, options.least_sigma_m].map(|sigma| sigma * sigma);
        let least = Matrix6::from_diagonal(&[turn, turn, turn, place, place, place].into());
        self.covariance * options.correlation + least
    }

    /// The edge between two nodes, the later camera first.
    pub(crate) fn factor(
        &self,
        later: VariableId,
        earlier: VariableId,
        options: &LoopOptions,
    ) -> Result<Between, GraphError> {
        Between::new(later, earlier, *self.later_from_earlier.isometry(), inverse(&self.inflated(options)))
    }
}
