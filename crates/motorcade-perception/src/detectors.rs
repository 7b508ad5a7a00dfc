//! The three kinds of detectors, as traits: networks and files of this crate implement them, and so can a caller.
//!
//! All are object safe. A detector may keep state between frames; frames come in order, each once.

use motorcade_dataset::Frame;

use crate::detection::Detection;
use crate::error::Result;
use crate::keypoints::VehicleKeypoints;
use crate::road::RoadMask;

/// Finds vehicles as boxes.
pub trait VehicleDetector: Send {
    /// Vehicles of a frame; boxes in pixels of the frame, pixel centres at integer coordinates.
    ///
    /// # Errors
    /// A detector that fails as such, which ends the run. A frame without vehicles is an empty list.
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>>;

    /// Source of the boxes in words, for the record of a run.
    fn description(&self) -> String;
}

/// Finds the road.
pub trait RoadSegmenter: Send {
    /// Probability of road by pixel of the frame; `None` when nothing is known of this frame.
    ///
    /// # Errors
    /// A segmenter that fails as such, which ends the run.
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>>;

    /// Source of the masks in words, for the record of a run.
    fn description(&self) -> String;
}

/// Finds the keypoints of vehicles.
pub trait KeypointDetector: Send {
    /// Keypoints of vehicles in a frame; `detections` are the boxes found in it. Vehicles without keypoints are left out.
    ///
    /// # Errors
    /// A detector that fails as such, which ends the run.
    fn keypoints(&mut self, frame: &Frame, detections: &[Detection]) -> Result<Vec<VehicleKeypoints>>;

    /// Called for a frame at this time \[ns\] whose keypoints are known from an earlier run, in place of [`keypoints`](Self::keypoints): a detector that remembers earlier
    /// frames keeps what it would remember, so that a resumed run finds the same.
    fn skipped(&mut self, _timestamp_ns: i64, _detections: &[Detection]) {}

    /// Source of the keypoints in words, for the record of a run.
    fn description(&self) -> String;
}
