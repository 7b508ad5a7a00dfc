//! State of a search between two keyframes, to be kept in a file.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::{PlaceSearch, SearchReport, Visit, descriptors};
use crate::keyframes::Keyframes;
use crate::verification::PlaceMatch;

/// State of a [`PlaceSearch`], without its camera and options.
#[derive(Serialize, Deserialize)]
pub struct PlaceSearchState<'a> {
    keyframes: Cow<'a, Keyframes>,
    visits: Vec<Visit>,
    verified: Vec<PlaceMatch>,
    report: SearchReport,
}

impl PlaceSearch {
    /// The state after the last keyframe.
    pub fn state(&self) -> PlaceSearchState<'_> {
        // The index is made of the keyframes again.
        let Self { camera: _, options: _, index: _, keyframes, visits, most_visits: _, verified, report } =
            self;
        PlaceSearchState {
            keyframes: Cow::Borrowed(keyframes),
            visits: visits.clone(),
            verified: verified.clone(),
            report: *report,
        }
    }

    /// As after the last keyframe of a state, with the camera and the options of this one, which has no keyframe in its index yet.
    /// `None` of a state that does not fit together.
    pub fn resumed(mut self, state: PlaceSearchState<'_>) -> Option<Self> {
        let PlaceSearchState { keyframes, visits, verified, report } = state;
        let keyframes = keyframes.into_owned();
        let known = |visit: &Visit| visit.place < visits.len();
        let matched = |m: &PlaceMatch| m.query < keyframes.len() && m.candidate < keyframes.len();
        let ordered = verified.is_sorted_by(|a, b| a.query < b.query);
        if visits.len() > keyframes.len()
            || !visits.iter().all(known)
            || !verified.iter().all(matched)
            || !ordered
        {
            return None;
        }
        (self.keyframes, self.visits, self.verified, self.report) = (keyframes, visits, verified, report);
        // Those that cannot be found, taken out or not, have no features.
        for k in 0..self.visits.len() {
            self.index.push(self.keyframes.get(k).into_iter().flat_map(descriptors));
        }
        Some(self)
    }
}
