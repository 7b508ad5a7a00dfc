//! Detections, keypoints and road masks from files.

mod detections;
mod keypoints;
mod road_masks;

pub use detections::{DetectionFormat, DetectionTable};
pub use keypoints::KeypointTable;
pub use road_masks::RoadMaskFolder;
