//! Output of the detectors over a drive, kept in memory. Its file is in `files/recording.rs`.

use std::collections::BTreeMap;

use crate::observations::Observations;

/// Output of the detectors by the input's own frame number.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    frames: BTreeMap<u64, Observations>,
    detectors: Descriptions,
}

/// Detectors that were there, in words.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Descriptions {
    pub(crate) vehicles: Option<String>,
    pub(crate) road: Option<String>,
    pub(crate) keypoints: Option<String>,
}

impl Recording {
    pub(crate) fn new(detectors: Descriptions) -> Self {
        Self { frames: BTreeMap::new(), detectors }
    }

    /// False when the frame was there already.
    pub(crate) fn insert(&mut self, number: u64, observations: Observations) -> bool {
        self.frames.insert(number, observations).is_none()
    }

    /// Output for the frame with this number.
    pub(crate) fn frame(&self, number: u64) -> Option<&Observations> {
        self.frames.get(&number)
    }

    pub(crate) fn detectors(&self) -> &Descriptions {
        &self.detectors
    }

    /// True when it has the frame with this number.
    pub fn has(&self, number: u64) -> bool {
        self.frames.contains_key(&number)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// True without a frame.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }
}
