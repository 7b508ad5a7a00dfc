//! The boxes of one vehicle.

use motorcade_perception::VehicleClass;

use crate::observed_box::ObservedBox;
use crate::trajectory::{Source, VehicleTrajectory};

/// One box of a track.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrackBox {
    /// Frame (row of the run).
    pub frame: usize,
    /// The box and its measured edges.
    pub observed: ObservedBox,
    /// Score.
    pub score: f64,
}

/// Identifies a box of a drive: its frame and the bits of its edges.
pub(crate) type BoxKey = (usize, [u64; 4]);

impl TrackBox {
    pub(crate) fn key(&self) -> BoxKey {
        (self.frame, self.observed.bbox.to_array().map(f64::to_bits))
    }
}

/// The boxes of one vehicle, in order of time.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Track {
    /// Identity.
    pub id: usize,
    /// Class with the largest sum of scores.
    pub class: VehicleClass,
    /// Votes of the boxes on the class.
    pub votes: ClassVotes,
    /// Boxes.
    pub boxes: Vec<TrackBox>,
}

impl Track {
    /// A track whose class is certain.
    pub fn new(id: usize, class: VehicleClass, boxes: Vec<TrackBox>) -> Self {
        Self { id, class, votes: ClassVotes::default(), boxes }
    }

    /// Some of its boxes as a track of this identity.
    pub(crate) fn with_boxes(&self, id: usize, boxes: Vec<TrackBox>) -> Self {
        Self { id, class: self.class, votes: self.votes, boxes }
    }

    /// Its boxes and later ones as one track of this identity, of the class that both vote for.
    pub(crate) fn continued_by(&self, later: &Self) -> Self {
        let boxes = self.boxes.iter().chain(&later.boxes).copied().collect();
        let mut track = self.with_boxes(self.id, boxes);
        track.votes.add_all(&later.votes);
        let class = if track.votes.shares().is_some() { track.votes.class() } else { self.class };
        track.set_class(class);
        track
    }

    /// The same boxes as a vehicle of another class.
    pub(crate) fn as_class(&self, class: VehicleClass) -> Self {
        let mut track = self.clone();
        track.set_class(class);
        track
    }

    /// Sets the class of the track and of its boxes.
    pub(crate) fn set_class(&mut self, class: VehicleClass) {
        self.class = class;
        for b in &mut self.boxes {
            b.observed.class = class;
        }
    }
}

/// The boxes of a track that a vehicle was made from; `None` for a vehicle of another track.
pub fn boxes_of(track: &Track, vehicle: &VehicleTrajectory) -> Option<Track> {
    let first = vehicle.states.first()?.frame;
    let is_own = |b: &&TrackBox| {
        let state = b.frame.checked_sub(first).and_then(|k| vehicle.states.get(k));
        state.is_some_and(|s| s.source != Source::Predicted && s.bbox == Some(b.observed.bbox))
    };
    let boxes: Vec<TrackBox> = track.boxes.iter().filter(is_own).copied().collect();
    (!boxes.is_empty()).then(|| track.with_boxes(vehicle.id, boxes))
}

/// Sums of scores by class.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct ClassVotes([f64; VehicleClass::ALL.len()]);

impl ClassVotes {
    /// One vote.
    pub(crate) fn of(class: VehicleClass) -> Self {
        let mut votes = Self::default();
        votes.add_score(class, 1.0);
        votes
    }

    /// Adds the vote of a box, whose weight is its score or `least`.
    pub(crate) fn add(&mut self, seen: &TrackBox, least: f64) {
        self.add_score(seen.observed.class, seen.score.max(least));
    }

    /// Adds a vote of this score.
    pub(crate) fn add_score(&mut self, class: VehicleClass, score: f64) {
        for (votes, known) in self.0.iter_mut().zip(VehicleClass::ALL) {
            if class == known {
                *votes += score;
            }
        }
    }

    /// Adds the votes of another track.
    fn add_all(&mut self, other: &Self) {
        for (votes, more) in self.0.iter_mut().zip(other.0) {
            *votes += more;
        }
    }

    /// Share of each class, in the order of [`VehicleClass::ALL`]; `None` without votes.
    pub(crate) fn shares(&self) -> Option<[f64; VehicleClass::ALL.len()]> {
        let sum: f64 = self.0.iter().sum();
        (sum > 0.0).then(|| self.0.map(|votes| votes / sum))
    }

    /// The class with the largest sum.
    pub(crate) fn class(&self) -> VehicleClass {
        let most = VehicleClass::ALL.into_iter().zip(self.0).max_by(|a, b| a.1.total_cmp(&b.1));
        most.map_or(VehicleClass::Car, |(class, _)| class)
    }
}
