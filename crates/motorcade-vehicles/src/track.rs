//! The boxes of one vehicle.

use motorcade_perception::VehicleClass;

use crate::observed_box::ObservedBox;

/// One box of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackBox {
    /// Frame (row of the run).
    pub frame: usize,
    /// The box and its measured edges.
    pub observed: ObservedBox,
    /// Score.
    pub score: f64,
}

/// The boxes of one vehicle, in order of time.
#[derive(Clone, Debug)]
pub struct Track {
    /// Identity.
    pub id: usize,
    /// Class with the largest sum of scores.
    pub class: VehicleClass,
    /// Boxes.
    pub boxes: Vec<TrackBox>,
}

/// Smallest weight of a box in the vote on the class.
const LEAST_VOTE: f64 = 0.01;

impl Track {
    /// Sets the class of the track, and of its boxes, to the one with the largest sum of scores.
    pub(crate) fn vote_class(&mut self) {
        let votes = |class: &VehicleClass| -> f64 {
            let same = self.boxes.iter().filter(|b| b.observed.class == *class);
            same.map(|b| b.score.max(LEAST_VOTE)).sum()
        };
        let most = VehicleClass::ALL.into_iter().max_by(|a, b| votes(a).total_cmp(&votes(b)));
        self.class = most.unwrap_or(VehicleClass::Car);
        for b in &mut self.boxes {
            b.observed.class = self.class;
        }
    }
}
