//! Output of the detectors over a drive, kept in memory.

use std::collections::BTreeMap;
use std::sync::Arc;

use motorcade_dataset::Frame;

use crate::detection::Detection;
use crate::detectors::{KeypointDetector, RoadSegmenter, VehicleDetector};
use crate::error::Result;
use crate::keypoints::VehicleKeypoints;
use crate::observations::Observations;
use crate::perception::Perception;
use crate::road::RoadMask;

/// Output of the detectors by the input's own frame number.
#[derive(Clone, Debug)]
pub struct Recording {
    frames: BTreeMap<u64, Observations>,
    description: (String, String),
    /// Detectors that were there: vehicles, road, keypoints.
    present: [bool; 3],
}

impl Recording {
    fn new(description: (String, String), present: [bool; 3]) -> Self {
        Self { frames: BTreeMap::new(), description, present }
    }

    fn insert(&mut self, number: u64, observations: Observations) {
        self.frames.insert(number, observations);
    }

    /// Detectors that answer from the recording.
    pub fn replay(self: &Arc<Self>) -> Perception {
        let [vehicles, road, keypoints] = self.present;
        let mut perception = Perception::none();
        if vehicles {
            perception = perception.with_detector(Replay(Arc::clone(self)));
        }
        if road {
            perception = perception.with_segmenter(Replay(Arc::clone(self)));
        }
        if keypoints {
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
        let mut recording = Recording::new(self.describe(), self.present());
        for frame in frames {
            recording.insert(frame.number, self.observe(&frame)?);
        }
        Ok(recording)
    }
}

struct Replay(Arc<Recording>);

impl VehicleDetector for Replay {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        Ok(self.0.frames.get(&frame.number).map_or_else(Vec::new, |o| o.detections.clone()))
    }
    fn description(&self) -> String {
        self.0.description.0.clone()
    }
}

impl RoadSegmenter for Replay {
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>> {
        Ok(self.0.frames.get(&frame.number).and_then(|o| o.road.clone()))
    }
    fn description(&self) -> String {
        self.0.description.1.clone()
    }
}

impl KeypointDetector for Replay {
    fn keypoints(&mut self, frame: &Frame, _detections: &[Detection]) -> Result<Vec<VehicleKeypoints>> {
        Ok(self.0.frames.get(&frame.number).map_or_else(Vec::new, |o| o.keypoints.clone()))
    }
    fn description(&self) -> String {
        "recorded keypoints".to_owned()
    }
}
