//! What a camera, a tracker and networks would measure of a drive, without a picture.

mod keypoints;
mod landmarks;
mod measurements;
mod noise;
mod outlook;

pub use keypoints::{KeypointMeasurement, KeypointOptions};
pub use landmarks::{PointObservation, RoadMatch};
pub use measurements::{MeasureOptions, Measurements};
pub(crate) use noise::Noise;
pub(crate) use outlook::Outlook;
