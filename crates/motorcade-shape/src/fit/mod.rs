//! Pose and shape of vehicles from 2D keypoints.

mod fitter;
mod heading;
mod hypotheses;
mod model;
mod observation;
mod options;
mod problem;
mod quality;
mod result;
mod search;
mod single;
mod solver;
mod track;
mod track_shape;

pub use fitter::ShapeFitter;
pub use heading::HeadingEvidence;
pub use observation::{MeasuredRoad, Observation, ObservedKeypoint};
pub use options::{AdvancedFitOptions, FitMethod, FitOptions};
pub use result::{Alternative, CLEAR_COST, ShapeFit};
pub use track::{FrameFit, TrackFit};
pub use track_shape::TrackShape;

/// Largest number of deformations of a fit: normal equations of fixed size stay on the stack.
pub const MAX_SHAPE: usize = 8;
/// Unknowns of one vehicle in one image: 6 of the pose, 8 of the shape.
const DOF: usize = 6 + MAX_SHAPE;
