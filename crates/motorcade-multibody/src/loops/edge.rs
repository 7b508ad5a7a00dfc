//! Edges of places seen again.

use motorcade_geometry::{Camera, Pose, World, lie::se3::adjoint};
use motorcade_graph::factors::Between;
use motorcade_graph::{Graph, GraphError, VariableId};
use nalgebra::Matrix6;

use super::options::LoopOptions;
use crate::edges::inverse;

/// A relative pose of two frames that see the same place.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
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
    /// The edge between two nodes, the later camera first.
    pub(crate) fn factor(
        &self,
        later: VariableId,
        earlier: VariableId,
        options: &LoopOptions,
    ) -> Result<Between, GraphError> {
        factor([later, earlier], &self.later_from_earlier, &self.covariance, options)
    }
}

/// The pose of a frame relative to a keyframe of a kept map.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct MapEdge {
    /// The frame.
    pub frame: usize,
    /// Pose of the keyframe in the world of the map, which is fixed \[m\].
    pub world_from_keyframe: Pose<World, Camera>,
    /// Covariance of that pose in the world of the map (6×6 `[ω, ν]`, right perturbation): neighbouring keyframes share it, so that it moves
    /// no camera; it is added to the covariances of cameras that are known by the map.
    pub keyframe_covariance: Matrix6<f64>,
    /// The frame's camera from the keyframe \[m\].
    pub camera_from_keyframe: Pose<Camera, Camera>,
    /// Its covariance (6×6 `[ω, ν]`, right perturbation).
    pub covariance: Matrix6<f64>,
}

impl MapEdge {
    /// The pose of the frame's camera by the keyframe.
    pub(crate) fn world_from_camera(&self) -> Pose<World, Camera> {
        self.world_from_keyframe * self.camera_from_keyframe.inverse()
    }

    /// Covariance of a camera that is known by the keyframe, as far as it is the keyframe's: `Ad(camera_from_keyframe) Σ Adᵀ`.
    pub(crate) fn covariance_at(&self, world_from_camera: &Pose<World, Camera>) -> Matrix6<f64> {
        let across = adjoint((world_from_camera.inverse() * self.world_from_keyframe).isometry());
        across * self.keyframe_covariance * across.transpose()
    }

    /// The edge between a camera and a fixed node that is added for the keyframe.
    pub(crate) fn factor(
        &self,
        camera: VariableId,
        graph: &mut Graph,
        options: &LoopOptions,
    ) -> Result<Between, GraphError> {
        let keyframe = graph.add_variable(*self.world_from_keyframe.isometry());
        graph.fix(keyframe)?;
        factor([camera, keyframe], &self.camera_from_keyframe, &self.covariance, options)
    }
}

/// Edges of places seen again.
#[derive(Clone, Debug, Default)]
pub struct PlaceEdges {
    /// Edges between frames of the drive.
    pub loops: Vec<LoopEdge>,
    /// Edges to keyframes of a kept map. With any of them the world is that of the map.
    pub map: Vec<MapEdge>,
}

impl PlaceEdges {
    /// True without any edge.
    pub fn is_empty(&self) -> bool {
        self.loops.is_empty() && self.map.is_empty()
    }
}

/// An edge whose covariance holds the errors that neighbouring edges share and those that no pixel shows.
fn factor(
    [later, earlier]: [VariableId; 2],
    later_from_earlier: &Pose<Camera, Camera>,
    covariance: &Matrix6<f64>,
    options: &LoopOptions,
) -> Result<Between, GraphError> {
    let [turn, place] =
        [options.advanced.least_sigma_rad, options.advanced.least_sigma_m].map(|sigma| sigma * sigma);
    let least = Matrix6::from_diagonal(&[turn, turn, turn, place, place, place].into());
    let inflated = covariance * options.advanced.correlation + least;
    Between::new(later, earlier, *later_from_earlier.isometry(), inverse(&inflated))
}
