//! The local map: keyframes, landmarks, bundle adjustment, and the pose of a frame against it.

mod baseline_length;
mod bundle;
mod bundle_problem;
mod keyframe;
mod landmark;
mod nearby_depths;
mod normal_equations;
mod options;
mod picture_shift;
mod pose_only;
mod reprojection;
mod road_point;
mod triangulation;
mod window;

pub use baseline_length::BaselineLength;
pub use bundle::BundleReport;
pub use bundle_problem::{BundleProblem, KeyframeObservation};
pub(crate) use keyframe::Keyframe;
pub use landmark::{Carrier, Landmark};
pub(crate) use nearby_depths::NearbyDepths;
pub(crate) use options::MOST_NEIGHBOURS;
pub use options::{BundleOptions, PoseOnlyOptions, WindowOptions};
pub use picture_shift::PictureShiftOptions;
pub(crate) use picture_shift::picture_shift;
pub use pose_only::{Observation, PoseEstimate, PoseRefiner};
pub use road_point::RoadPoint;
pub(crate) use window::Window;
