//! Simulated measurements of a tracker, a detector and keypoint networks, without rendering.

mod keypoints;
mod landmarks;
mod measurements;
mod noise;
mod outlines;

pub use keypoints::{KeypointMeasurement, KeypointOptions};
pub use landmarks::{PointObservation, RoadMatch};
pub use measurements::{MeasureOptions, Measurements};
pub(crate) use noise::Noise;
pub(crate) use outlines::FrameOutlines;
