//! Simulated measurements of a tracker, a detector and keypoint networks, without rendering.

pub(crate) mod detections;
mod keypoints;
pub(crate) mod labels;
mod landmarks;
mod measurements;
mod noise;
mod options;
mod outlines;

pub use keypoints::{KeypointMeasurement, KeypointOptions};
pub use landmarks::{PointObservation, RoadMatch};
pub use measurements::Measurements;
pub(crate) use noise::Noise;
pub use options::MeasureOptions;
pub(crate) use outlines::FrameOutlines;
