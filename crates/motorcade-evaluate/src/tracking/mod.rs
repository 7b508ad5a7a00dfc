//! Metrics of multi-object tracking on cars, by the rules of KITTI's tracking benchmark.

mod frame;
mod tracking2d;
mod tracking3d;

pub use tracking2d::Tracking2dReport;
pub use tracking3d::{Tracking3d, Tracking3dReport};

pub(crate) use frame::TrackingFrame;
pub(crate) use tracking2d::evaluate as evaluate_2d;
pub(crate) use tracking3d::evaluate as evaluate_3d;
