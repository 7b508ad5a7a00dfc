//! Pose and shape of vehicles from 2D keypoints.

mod hypotheses;
mod model;
mod observation;
mod options;
mod problem;
mod search;
mod single;
mod solver;
mod track;
mod track_shape;

pub use observation::{ImageBox, Observation, ObservedKeypoint, RoadPlane};
pub use options::{FitMethod, FitOptions};
pub use single::{Alternative, ShapeFit, ShapeFitter};
pub use track::{FrameFit, TrackFit};
pub use track_shape::TrackShape;

/// Most deformations a fit uses: normal equations of fixed size stay on the stack.
pub const MAX_SHAPE: usize = 8;
/// Unknowns of one vehicle in one image: 6 of the pose, 8 of the shape.
const DOF: usize = 6 + MAX_SHAPE;
