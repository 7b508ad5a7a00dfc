//! Detectors that are recorded, and detectors that answer from a recording.

use std::sync::Arc;

use motorcade_dataset::Frame;

use crate::detection::Detection;
use crate::detectors::{KeypointDetector, RoadSegmenter, VehicleDetector};
use crate::error::Result;
use crate::keypoints::VehicleKeypoints;
use crate::perception::Perception;
use crate::recording::{Descriptions, Recording};
use crate::road::RoadMask;

impl Recording {
    /// Detectors that answer from the recording.
    pub fn replay(self: &Arc<Self>) -> Perception {
        let Descriptions { vehicles, road, keypoints } = self.detectors();
        let mut perception = Perception::none();
        if vehicles.is_some() {
            perception = perception.with_detector(Replay(Arc::clone(self)));
        }
        if road.is_some() {
            perception = perception.with_segmenter(Replay(Arc::clone(self)));
        }
        if keypoints.is_some() {
            perception = perception.with_keypoints(Replay(Arc::clone(self)));
        }
        perception
    }
}

impl Perception {
    /// Runs the detectors on every frame once and keeps their output, for many runs on the same frames.
    ///
    /// # Errors
    /// A detector that fails.
    pub fn record(&mut self, frames: impl Iterator<Item = Frame>) -> Result<Recording> {
        let mut recording = Recording::new(self.descriptions());
        for frame in frames {
            recording.insert(frame.number, self.observe(&frame)?);
        }
        Ok(recording)
    }
}

struct Replay(Arc<Recording>);

impl VehicleDetector for Replay {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        Ok(self.0.frame(frame.number).map_or_else(Vec::new, |o| o.detections.clone()))
    }
    fn description(&self) -> String {
        self.0.detectors().vehicles.clone().unwrap_or_default()
    }
}

impl RoadSegmenter for Replay {
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>> {
        Ok(self.0.frame(frame.number).and_then(|o| o.road.clone()))
    }
    fn description(&self) -> String {
        self.0.detectors().road.clone().unwrap_or_default()
    }
}

impl KeypointDetector for Replay {
    fn keypoints(&mut self, frame: &Frame, _detections: &[Detection]) -> Result<Vec<VehicleKeypoints>> {
        Ok(self.0.frame(frame.number).map_or_else(Vec::new, |o| o.keypoints.clone()))
    }
    fn description(&self) -> String {
        self.0.detectors().keypoints.clone().unwrap_or_default()
    }
}
