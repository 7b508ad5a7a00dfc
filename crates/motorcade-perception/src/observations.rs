//! Output of the detectors for one frame.

use crate::detection::Detection;
use crate::keypoints::VehicleKeypoints;
use crate::road::RoadMask;

/// Output of the detectors for one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// Vehicles, best first from networks, in the order of the file from files.
    pub detections: Vec<Detection>,
    /// The road, when a segmenter is there.
    pub road: Option<RoadMask>,
    /// Keypoints of vehicles.
    pub keypoints: Vec<VehicleKeypoints>,
}
