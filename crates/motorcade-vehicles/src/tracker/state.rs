//! State of a tracker between two frames, to be kept in a file.

use serde::{Deserialize, Serialize};

use super::Tracker;
use super::active_track::ActiveTrack;

/// State of a [`Tracker`], without its camera and options.
#[derive(Serialize, Deserialize)]
pub struct TrackerState {
    active: Vec<ActiveTrack>,
    next_id: usize,
}

impl Tracker {
    /// The state after the last frame.
    pub fn state(&self) -> TrackerState {
        let Self { localizer: _, options: _, least_standing_overlap: _, active, next_id } = self;
        TrackerState { active: active.clone(), next_id: *next_id }
    }

    /// As after the last frame of a state, with the camera and the options of this one.
    #[must_use]
    pub fn resumed(self, state: TrackerState) -> Self {
        let TrackerState { active, next_id } = state;
        Self { active, next_id, ..self }
    }
}
