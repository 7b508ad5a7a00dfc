//! Detections, keypoints, road masks and recordings of all of them from files.

mod checkpoint;
mod detections;
mod keypoints;
mod recording;
mod road_masks;

pub use checkpoint::{Checkpoint, Identity, SkippedFrame};
pub use detections::{DetectionFormat, DetectionTable};
pub use keypoints::KeypointTable;
pub use recording::KeptObservations;
pub use road_masks::RoadMaskFolder;
