//! The local map: keyframes, landmarks, bundle adjustment, and the pose of a frame against it.

mod bundle;
mod landmark;
mod nearby_depths;
mod pose_only;
mod road_point;
mod window;

pub use bundle::{BundleOptions, BundleProblem, Sighting};
pub use landmark::Landmark;
pub(crate) use nearby_depths::NearbyDepths;
pub use pose_only::{Observation, PoseEstimate, PoseOnlyOptions, PoseRefiner};
pub use window::WindowOptions;
pub(crate) use window::{Keyframe, Window};
