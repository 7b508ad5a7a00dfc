//! Vehicles whose boxes several tracks have, one after the other or in turn.
//!
//! A vehicle that was hidden, or to which a detector gave a box unlike those before, may go on as another track, or be two for a while. Two vehicles are
//! one where the boxes of both make a vehicle that fits each of them.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{UnitQuaternion, Vector3};

use super::consistency::{overlap_in, overlap_of_columns};
use super::drive::Drive;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::options::VehicleOptions;
use crate::track::{Track, TrackBox, boxes_of};
use crate::trajectory::VehicleTrajectory;

/// Makes one vehicle of two that are not seen side by side, of which one is predicted where the other is seen within `longest_gap_s`, if the boxes of both
/// make one that stands or moves as they do and fits those of each; the pair that fits best first. It keeps the smaller identity.
pub fn join_parted(
    (camera, grounds): (&PinholeCamera, &[GroundFrame]),
    vehicles: Vec<VehicleTrajectory>,
    tracks: &[Track],
    views: &impl Fn(&Track) -> ExternalTrack,
    options: &VehicleOptions,
    longest_gap_s: f64,
) -> Vec<VehicleTrajectory> {
    let drive = Drive { camera, grounds, views, options };
    let pairing = Pairing { drive, longest_gap_s };
    // Those that were joined become `None`.
    let mut parts: Vec<Option<Part>> = Vec::with_capacity(vehicles.len());
    let mut pairs: Vec<Pair> = Vec::new();
    for vehicle in vehicles {
        let boxes = tracks.iter().find_map(|track| boxes_of(track, &vehicle));
        let boxes = boxes.unwrap_or_else(|| Track::new(vehicle.id, vehicle.class, Vec::new()));
        pairing.add(Part { vehicle, boxes }, &mut parts, &mut pairs);
    }
    while let Some(pair) = take_best(&mut pairs) {
        pair.of.iter().for_each(|k| parts[*k] = None);
        pairs.retain(|other| other.of.iter().all(|k| !pair.of.contains(k)));
        pairing.add(pair.one, &mut parts, &mut pairs);
    }
    let mut out: Vec<VehicleTrajectory> = parts.into_iter().flatten().map(|part| part.vehicle).collect();
    out.sort_by_key(|vehicle| vehicle.id);
    out
}

/// A vehicle with the boxes that it was made from.
struct Part {
    vehicle: VehicleTrajectory,
    boxes: Track,
}

/// Two parts that may be one vehicle.
struct Pair {
    /// Their places in the list.
    of: [usize; 2],
    /// Vehicle with the boxes of both.
    one: Part,
    /// Measure of the fit of its boxes.
    value: f64,
}

/// The pair of the largest value, of equal ones the first.
fn take_best(pairs: &mut Vec<Pair>) -> Option<Pair> {
    let by_value = |a: &usize, b: &usize| pairs[*a].value.total_cmp(&pairs[*b].value).then(b.cmp(a));
    let best = (0..pairs.len()).max_by(by_value)?;
    Some(pairs.remove(best))
}

struct Pairing<'a, V> {
    drive: Drive<'a, V>,
    longest_gap_s: f64,
}

impl<V: Fn(&Track) -> ExternalTrack> Pairing<'_, V> {
    /// Adds a part with its pairs.
    fn add(&self, part: Part, parts: &mut Vec<Option<Part>>, pairs: &mut Vec<Pair>) {
        let index = parts.len();
        let with = |(k, other): (usize, &Option<Part>)| {
            let (one, value) = self.one_of(other.as_ref()?, &part)?;
            Some(Pair { of: [k, index], one, value })
        };
        pairs.extend(parts.iter().enumerate().filter_map(with));
        parts.push(Some(part));
    }

    /// The vehicle with the boxes of both, those of the first where both have one, and its value: the sum over its boxes of the overlap beyond that of a
    /// box which speaks neither for nor against it, as in [`explain_boxes`](super::explain_boxes). `None` where they are two.
    fn one_of(&self, first: &Part, second: &Part) -> Option<(Part, f64)> {
        if !self.may_be_one(first, second) {
            return None;
        }
        let mut rest = second.boxes.clone();
        rest.boxes.retain(|b| first.boxes.boxes.iter().all(|own| own.frame != b.frame));
        if rest.boxes.is_empty() {
            return None;
        }
        let mut boxes = first.boxes.continued_by(&rest);
        boxes.boxes.sort_by_key(|b| b.frame);
        boxes.id = first.vehicle.id.min(second.vehicle.id);
        let vehicle = self.drive.estimate(&boxes)?;
        let moves = |vehicle: &VehicleTrajectory| self.drive.moves(vehicle);
        // A slow motion explains the boxes of two that stand one behind the other.
        if moves(&vehicle) != moves(&first.vehicle) || moves(&vehicle) != moves(&second.vehicle) {
            return None;
        }
        let hypothesis = self.drive.hypothesis();
        let overlaps = |part: &Track| self.drive.overlaps(overlap_of_columns, part, &vehicle);
        let (of_first, of_rest) = (overlaps(&first.boxes), overlaps(&rest));
        let fits =
            |overlaps: &[f64]| overlaps.iter().sum::<f64>() >= hypothesis.double_iou * overlaps.len() as f64;
        let value = of_first.iter().chain(&of_rest).map(|overlap| overlap - hypothesis.neutral_overlap).sum();
        (fits(&of_first) && fits(&of_rest)).then_some((Part { vehicle, boxes }, value))
    }

    /// True when two parts follow each other in time within the gap, one where the other is predicted, and are not seen side by side.
    fn may_be_one(&self, first: &Part, second: &Part) -> bool {
        let (a, b) = (&first.boxes.boxes, &second.boxes.boxes);
        let time_s = |b: &TrackBox| self.drive.grounds.get(b.frame).map_or(0.0, |g| g.time_s);
        let after_s = |earlier: &[TrackBox], later: &[TrackBox]| {
            let ends = earlier.last().zip(later.first());
            ends.map_or(f64::INFINITY, |(end, start)| time_s(start) - time_s(end))
        };
        // Most pairs of a long drive are minutes apart.
        if after_s(a, b).max(after_s(b, a)) > self.longest_gap_s {
            return false;
        }
        let mut seen: Vec<(&TrackBox, bool)> = a.iter().map(|x| (x, false)).collect();
        seen.extend(b.iter().map(|x| (x, true)));
        seen.sort_by_key(|(b, of_second)| (b.frame, *of_second));
        let changes = || seen.windows(2).filter(|w| w[0].1 != w[1].1).map(|w| [w[0].0, w[1].0]);
        let hypothesis = self.drive.hypothesis();
        let beside = changes().filter(|[p, q]| p.frame == q.frame && self.apart(p, q)).count();
        // In a single frame a vehicle may have two boxes, on both sides of what is in front of it.
        if beside as f64 > (hypothesis.most_foreign_share * a.len().min(b.len()) as f64).max(1.0) {
            return false;
        }
        let gap_s = changes().map(|[p, q]| time_s(q) - time_s(p)).fold(f64::INFINITY, f64::min);
        let meet = |[p, q]: [&TrackBox; 2]| self.meet(first, second, p) || self.meet(first, second, q);
        gap_s <= self.longest_gap_s && changes().any(meet)
    }

    /// True when the part that does not have a box is predicted within the vehicle of the part that has it, or, where both stand, in its box: errors of
    /// depth put a standing vehicle farther away than it is long, but vehicles of a lane are in line too.
    fn meet(&self, first: &Part, second: &Part, b: &TrackBox) -> bool {
        let is_first = first.boxes.boxes.contains(b);
        let (own, other) = if is_first { (first, second) } else { (second, first) };
        let places = self.place(&own.vehicle, b.frame).zip(self.place(&other.vehicle, b.frame));
        places.is_some_and(|(own_place, place)| {
            let size = &own.vehicle.size;
            let apart = (own_place.inverse() * place).translation();
            let states = &other.vehicle.states;
            let span = states.first().map_or(0, |s| s.frame)..=states.last().map_or(0, |s| s.frame);
            // A track in a gap of another one is hardly that of a vehicle beside it, which would be seen before or after.
            let near = if span.contains(&b.frame) {
                apart.norm() <= size.length_m.max(other.vehicle.size.length_m)
            } else {
                apart.x.abs() <= size.length_m && apart.y.abs() <= size.width_m
            };
            let stand = !self.drive.moves(&own.vehicle) && !self.drive.moves(&other.vehicle);
            let in_box = || overlap_in(overlap_of_columns, self.drive.camera, &other.vehicle, &place, b);
            near || (stand && in_box().is_some_and(|overlap| overlap >= self.drive.hypothesis().double_iou))
        })
    }

    /// True when neither of two boxes is a part of the other.
    fn apart(&self, p: &TrackBox, q: &TrackBox) -> bool {
        let (p, q) = (&p.observed.bbox, &q.observed.bbox);
        p.intersection(q) <= self.drive.hypothesis().double_inside * p.area().min(q.area())
    }

    /// Place of a vehicle, which goes on straight and at its speed before its first and after its last frame.
    fn place(&self, vehicle: &VehicleTrajectory, frame: usize) -> Option<Pose<Camera, Vehicle>> {
        let state = vehicle.states.iter().min_by_key(|s| s.frame.abs_diff(frame))?;
        let (now, then) = (self.drive.grounds.get(frame)?, self.drive.grounds.get(state.frame)?);
        let speed_mps = if self.drive.moves(vehicle) { state.speed_mps } else { 0.0 };
        let ahead = Pose::from_parts(
            UnitQuaternion::identity(),
            Vector3::x() * (speed_mps * (now.time_s - then.time_s)),
        );
        Some(now.world_from_camera.inverse() * state.world_from_vehicle * ahead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::estimate_track;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, seen_driving as seen, track_of};
    use crate::trajectory::{Source, VehicleState};

    /// Identities, numbers of states and of those predicted after the join.
    fn joined(tracks: &[Track], longest_gap_s: f64) -> Vec<(usize, usize, usize)> {
        let (grounds, options) = (level_grounds(80), VehicleOptions::default());
        let none = |_: &Track| ExternalTrack::default();
        let estimate = |t: &Track| estimate_track(&CAMERA, &grounds, t, &none(t), &options).unwrap();
        let vehicles: Vec<VehicleTrajectory> = tracks.iter().map(estimate).collect();
        let found = join_parted((&CAMERA, &grounds), vehicles, tracks, &none, &options, longest_gap_s);
        let predicted =
            |v: &VehicleTrajectory| v.states.iter().filter(|s| s.source == Source::Predicted).count();
        found.iter().map(|v| (v.id, v.states.len(), predicted(v))).collect()
    }

    #[test]
    fn a_moving_car_that_is_seen_again_is_the_same() {
        let (first, second) = (seen(3, 0..15, 0.0, 1.0), seen(1, 20..40, 0.0, 1.0));
        assert_eq!(joined(&[first.clone(), second.clone()], 2.0), [(1, 40, 5)]);
        // And once more.
        let third = seen(7, 41..70, 0.0, 1.0);
        assert_eq!(joined(&[first.clone(), second.clone(), third], 2.0), [(1, 70, 6)]);
        // After too long a gap, in the other lane, and where another one would be by then.
        assert_eq!(joined(&[first.clone(), second], 0.4).len(), 2);
        assert_eq!(joined(&[first.clone(), seen(1, 20..40, 3.5, 1.0)], 2.0).len(), 2);
        let mut ahead = seen(1, 28..48, 0.0, 1.0);
        ahead.boxes.iter_mut().for_each(|b| b.frame -= 8);
        assert_eq!(joined(&[first, ahead], 2.0).len(), 2);
    }

    #[test]
    fn boxes_in_the_gap_of_a_moving_car_are_its_own() {
        let with_gap = seen(3, (0..12).chain(22..40), 0.0, 1.0);
        let second = seen(7, 13..20, 0.0, 1.0);
        assert_eq!(joined(&[with_gap.clone(), second.clone()], 2.0), [(3, 40, 3)]);
        assert_eq!(joined(&[second, with_gap.clone()], 2.0), [(3, 40, 3)]);
        // Two in the next lane.
        assert_eq!(joined(&[with_gap, seen(7, 13..20, 5.0, 1.0)], 2.0).len(), 2);
    }

    /// Boxes of a car that stands, of the first ten frames and others.
    fn standing(id: usize, frames: &[usize], x_m: f64, z_m: f64) -> Track {
        let mut car = car_ahead(id, x_m, z_m);
        let model = car.states[0].clone();
        car.states = frames.iter().map(|frame| VehicleState { frame: *frame, ..model.clone() }).collect();
        track_of(&car, [true; 4])
    }

    #[test]
    fn a_standing_car_seen_in_turn_is_one_and_neighbours_are_two() {
        let (even, odd): (Vec<usize>, Vec<usize>) = (0..20).partition(|k| k % 2 == 0);
        assert_eq!(joined(&[standing(1, &even, 4.0, 30.0), standing(2, &odd, 4.0, 30.0)], 2.0), [(1, 20, 0)]);
        // The next one of a row across the road, and one in the other half of the picture.
        assert_eq!(joined(&[standing(1, &even, 4.0, 30.0), standing(2, &odd, 6.0, 30.0)], 2.0).len(), 2);
        assert_eq!(joined(&[standing(1, &even, 4.0, 30.0), standing(2, &odd, -4.0, 30.0)], 2.0).len(), 2);
    }
}
