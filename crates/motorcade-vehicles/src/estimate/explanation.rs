//! The vehicles that explain the boxes of a drive best.
//!
//! Boxes that are linked forwards and backwards in time make vehicles that share boxes. A box shows one vehicle: where the two ways disagree, the vehicle
//! that most boxes fit well stays, and others keep what it leaves of theirs (greedy weighted set packing).

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use motorcade_geometry::PinholeCamera;

use super::consistency::overlap_of_columns;
use super::drive::Drive;
use super::parts::{dense, estimate_consistently};
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::options::VehicleOptions;
use crate::track::{BoxKey, Track, TrackBox, boxes_of};
use crate::tracker::TrackerOptions;
use crate::trajectory::VehicleTrajectory;

/// Chooses of vehicles that may share boxes those that fit them best, so that each box is that of one, with identities from 1 on in order of time. A
/// vehicle of which others have boxes is estimated anew from the rest, or leaves the rest to one that explains them too. Returns the boxes of each as a
/// track of its identity.
pub fn explain_boxes(
    (camera, grounds): (&PinholeCamera, &[GroundFrame]),
    vehicles: Vec<(VehicleTrajectory, Track)>,
    views: &impl Fn(&Track) -> ExternalTrack,
    (options, tracker): (&VehicleOptions, &TrackerOptions),
    stop: &dyn Fn() -> bool,
) -> (Vec<VehicleTrajectory>, Vec<Track>) {
    let mut choice = Choice {
        drive: Drive { camera, grounds, views, options },
        begin_score: tracker.begin_score,
        stop,
        open: Vec::with_capacity(vehicles.len()),
        ranks: BinaryHeap::new(),
        holders: BTreeMap::new(),
    };
    for (vehicle, boxes) in vehicles {
        choice.add(choice.candidate(vehicle, boxes));
    }
    let mut found = Vec::new();
    while let Some(best) = choice.take_best() {
        found.push(choice.decide(best));
    }
    found.sort_by_key(|one| (one.vehicle.states.first().map(|s| s.frame), one.boxes.id));
    for (k, one) in found.iter_mut().enumerate() {
        (one.vehicle.id, one.boxes.id) = (k + 1, k + 1);
    }
    found.into_iter().map(|one| (one.vehicle, one.boxes)).unzip()
}

/// A vehicle that may be chosen, with the boxes that it was made from.
struct Candidate {
    vehicle: VehicleTrajectory,
    boxes: Track,
    /// Measure of the fit of its boxes.
    value: f64,
}

/// Candidates that are not decided yet.
struct Choice<'a, V> {
    drive: Drive<'a, V>,
    /// Score from which a box may start a track.
    begin_score: f64,
    stop: &'a dyn Fn() -> bool,
    /// `None` for those that are decided.
    open: Vec<Option<Candidate>>,
    ranks: BinaryHeap<Rank>,
    /// Candidates with each box, decided ones too.
    holders: BTreeMap<BoxKey, Vec<usize>>,
}

impl<V: Fn(&Track) -> ExternalTrack> Choice<'_, V> {
    fn add(&mut self, candidate: Candidate) {
        let index = self.open.len();
        self.ranks.push(Rank { value: candidate.value, index });
        for b in &candidate.boxes.boxes {
            self.holders.entry(b.key()).or_default().push(index);
        }
        self.open.push(Some(candidate));
    }

    /// Its value is the sum over its boxes of the overlap beyond that of a box which speaks neither for nor against it. Boxes before the first and after
    /// the last one that could start a track count against it alone: a vehicle that moves follows weak boxes wherever they are.
    fn candidate(&self, vehicle: VehicleTrajectory, boxes: Track) -> Candidate {
        let neutral = self.drive.hypothesis().neutral_overlap;
        let clear = |b: &TrackBox| b.score >= self.begin_score;
        let first = boxes.boxes.iter().position(clear).unwrap_or(boxes.boxes.len());
        let last = boxes.boxes.iter().rposition(clear).unwrap_or(0);
        let overlaps = self.drive.overlaps(overlap_of_columns, &boxes, &vehicle);
        let one = |(k, overlap): (usize, f64)| {
            let beyond = overlap - neutral;
            if (first..=last).contains(&k) { beyond } else { beyond.min(0.0) }
        };
        let value = overlaps.into_iter().enumerate().map(one).sum();
        Candidate { vehicle, boxes, value }
    }

    /// The open candidate of the largest value.
    fn take_best(&mut self) -> Option<Candidate> {
        loop {
            let rank = self.ranks.pop()?;
            if let Some(best) = self.open[rank.index].take() {
                return Some(best);
            }
        }
    }

    /// The candidate with what others can give it; none of them has a box of it afterwards.
    fn decide(&mut self, mut best: Candidate) -> Candidate {
        while let Some(other) = self.take_sharing(&best) {
            let own: BTreeSet<BoxKey> = best.boxes.boxes.iter().map(TrackBox::key).collect();
            let rest: Vec<TrackBox> =
                other.boxes.boxes.iter().filter(|b| !own.contains(&b.key())).copied().collect();
            if rest.is_empty() || (self.stop)() {
                continue;
            }
            let rest = other.boxes.with_boxes(other.boxes.id, rest);
            if let Some(one) = self.with_rest(&best, &rest) {
                best = one;
            } else {
                self.add_rest(rest);
            }
        }
        best
    }

    /// The vehicles of boxes that one has left: an estimate may leave out some of them again.
    fn add_rest(&mut self, mut rest: Track) {
        while self.drive.enough(&rest.boxes)
            && dense(&rest.boxes)
            && let Some(vehicle) = self.estimate(&rest)
            && let Some(own) = boxes_of(&rest, &vehicle)
        {
            let keys: BTreeSet<BoxKey> = own.boxes.iter().map(TrackBox::key).collect();
            rest.boxes.retain(|b| !keys.contains(&b.key()));
            self.add(self.candidate(vehicle, own));
        }
    }

    /// The open candidate of the largest value among those that share boxes with one.
    fn take_sharing(&mut self, best: &Candidate) -> Option<Candidate> {
        let holders = best.boxes.boxes.iter().filter_map(|b| self.holders.get(&b.key())).flatten();
        let ranks = holders.filter_map(|index| {
            let value = self.open[*index].as_ref()?.value;
            Some(Rank { value, index: *index })
        });
        let next = ranks.max()?;
        self.open[next.index].take()
    }

    /// A vehicle with the boxes of another one too; `None` where it does not explain both.
    fn with_rest(&self, best: &Candidate, rest: &Track) -> Option<Candidate> {
        let mut others = rest.clone();
        others.boxes.retain(|b| best.boxes.boxes.iter().all(|own| own.frame != b.frame));
        // Most frames with a box of each are those of two vehicles.
        if others.boxes.is_empty() || 2 * others.boxes.len() < rest.boxes.len() {
            return None;
        }
        let mut both = best.boxes.continued_by(&others);
        both.boxes.sort_by_key(|b| b.frame);
        let vehicle = self.estimate(&both)?;
        let hypothesis = self.drive.hypothesis();
        let least_iou = hypothesis.least_standing_iou;
        let explains = |part: &Track| {
            let own = self.drive.explained(overlap_of_columns, part, &vehicle, least_iou);
            let foreign = own.iter().filter(|own| !**own).count();
            foreign as f64 <= hypothesis.most_foreign_share * own.len() as f64
        };
        if !explains(&best.boxes) || !explains(&others) {
            return None;
        }
        let one = self.candidate(vehicle, both);
        (one.value >= best.value).then_some(one)
    }

    fn estimate(&self, boxes: &Track) -> Option<VehicleTrajectory> {
        let Drive { camera, grounds, views, options } = &self.drive;
        estimate_consistently(camera, grounds, boxes, *views, options, None).pop()
    }
}

/// Rank of a candidate: a larger value first, of equal ones the earlier one.
#[derive(Clone, Copy)]
struct Rank {
    value: f64,
    index: usize,
}

impl Ord for Rank {
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.total_cmp(&other.value).then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Rank {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Rank {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Rank {}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::estimate::estimate_track;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, seen_driving, track_of};

    /// Boxes of a car that stands at this place 20 m ahead, in these frames.
    fn standing(id: usize, frames: Range<usize>, x_m: f64) -> Track {
        let seen = track_of(&car_ahead(id, x_m, 20.0), [true; 4]);
        let boxes = frames.map(|frame| TrackBox { frame, ..seen.boxes[0] }).collect();
        seen.with_boxes(id, boxes)
    }

    /// Boxes of one track after those of another one.
    fn slipped(id: usize, first: Track, then: &Track) -> Track {
        let mut track = first.continued_by(then);
        track.id = id;
        track
    }

    /// Identity, first frame and number of boxes of the vehicles that are chosen, and the place of each beside the camera [m].
    fn explained(tracks: &[Track]) -> Vec<(usize, usize, usize, f64)> {
        let (grounds, options) = (level_grounds(60), VehicleOptions::default());
        let none = |_: &Track| ExternalTrack::default();
        let estimate = |t: &Track| estimate_track(&CAMERA, &grounds, t, &none(t), &options).unwrap();
        let vehicles = tracks.iter().map(|track| (estimate(track), track.clone())).collect();
        let all = (&options, &TrackerOptions::default());
        let (found, boxes) = explain_boxes((&CAMERA, &grounds), vehicles, &none, all, &|| false);
        let one = |(vehicle, track): (&VehicleTrajectory, &Track)| {
            assert_eq!(vehicle.id, track.id);
            let place = vehicle.states[0].world_from_vehicle.translation();
            (vehicle.id, track.boxes[0].frame, track.boxes.len(), (2.0 * place.x).round() / 2.0)
        };
        found.iter().zip(&boxes).map(one).collect()
    }

    #[test]
    fn a_track_that_slips_leaves_its_boxes_to_two_cars() {
        let (left, right) = (standing(4, 0..40, -1.5), standing(5, 5..45, 1.5));
        let slip = slipped(1, standing(1, 0..20, -1.5), &standing(1, 20..45, 1.5));
        let expected = [(1, 0, 40, -1.5), (2, 5, 40, 1.5)];
        assert_eq!(explained(&[slip.clone(), left.clone(), right.clone()]), expected);
        assert_eq!(explained(&[right, left, slip]), expected);
    }

    #[test]
    fn pieces_of_one_car_are_one_vehicle() {
        let pieces = [standing(1, 0..30, -1.5), standing(2, 20..45, -1.5)];
        assert_eq!(explained(&pieces), [(1, 0, 45, -1.5)]);
        let driving = [seen_driving(7, 0..30, 0.0, 1.0), seen_driving(8, 10..50, 0.0, 1.0)];
        assert_eq!(explained(&driving), [(1, 0, 50, 0.0)]);
        // Without a box in common they are left to those who join by place and motion.
        assert_eq!(explained(&[standing(1, 0..20, -1.5), standing(2, 25..45, -1.5)]).len(), 2);
    }

    #[test]
    fn weak_boxes_at_the_ends_count_for_no_vehicle() {
        let (grounds, options) = (level_grounds(60), VehicleOptions::default());
        let none = |_: &Track| ExternalTrack::default();
        let drive = Drive { camera: &CAMERA, grounds: &grounds, views: &none, options: &options };
        let (open, ranks, holders) = (Vec::new(), BinaryHeap::new(), BTreeMap::new());
        let choice = Choice { drive, begin_score: 0.5, stop: &|| false, open, ranks, holders };
        let value = |weak: &dyn Fn(usize) -> bool| {
            let mut track = standing(1, 0..20, 0.0);
            for b in &mut track.boxes {
                b.score = if weak(b.frame) { 0.2 } else { 0.8 };
            }
            choice.candidate(choice.drive.estimate(&track).unwrap(), track).value
        };
        let all = value(&|_| false);
        // Each of its boxes fits as the others do.
        assert!(all > 20.0 * 0.3, "{all}");
        assert!((value(&|frame| !(5..15).contains(&frame)) - 0.5 * all).abs() < 0.01 * all);
        assert!((value(&|frame| (5..15).contains(&frame)) - all).abs() < 0.01 * all);
        assert!(value(&|_| true).abs() < 1e-12);
    }

    #[test]
    fn what_is_left_of_a_vehicle_is_estimated_anew() {
        let slip = slipped(1, standing(1, 0..20, -1.5), &standing(1, 20..45, 1.5));
        let right = standing(5, 5..45, 1.5);
        assert_eq!(explained(&[slip, right]), [(1, 0, 20, -1.5), (2, 5, 40, 1.5)]);
        assert!(explained(&[]).is_empty());
    }
}
