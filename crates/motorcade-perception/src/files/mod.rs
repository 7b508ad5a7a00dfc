//! Perception made elsewhere.

mod detections;
mod road_masks;

pub use detections::{DetectionFormat, DetectionTable};
pub use road_masks::RoadMaskFolder;
