//! Clutter in tracks.
//!
//! Something that is taken for a vehicle here and there starts a track, or prolongs one whose vehicle has left, by scattered and weak boxes between
//! which the motion is predicted. A vehicle in view is found in most frames (Musicki and Evans, Joint Integrated Probabilistic Data
//! Association, IEEE TAES 2004, estimate the probability that a track exists by found and missed boxes).

use std::ops::RangeInclusive;

use motorcade_geometry::{BoundingBox, PinholeCamera};

use crate::doubles::is_second_box;
use crate::ground::GroundFrame;
use crate::hiding::Pictures;
use crate::options::{HypothesisOptions, VehicleOptions};
use crate::time::independent_views;
use crate::track::{Track, boxes_of};
use crate::tracker::TrackerOptions;
use crate::trajectory::{Source, VehicleState, VehicleTrajectory};

/// The vehicles without clutter at the beginning and end of their tracks; those that had some are estimated anew from the boxes that
/// remain. Tracks that are nothing else are left out, and parts of tracks of which no box could have started one.
pub fn without_clutter(
    vehicles: Vec<VehicleTrajectory>,
    tracks: &[Track],
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    (options, tracker): (&VehicleOptions, &TrackerOptions),
    estimate: impl Fn(&Track) -> Option<VehicleTrajectory>,
) -> Vec<VehicleTrajectory> {
    let seen = seen_frames(&vehicles, tracks, camera, grounds, (options, tracker.least_score));
    let cleaned = |(vehicle, frames): (VehicleTrajectory, Option<RangeInclusive<usize>>)| {
        let frames = frames?;
        let of_frames = || vehicle.states.iter().filter(|s| is_seen(s) && frames.contains(&s.frame));
        if !of_frames().any(|s| s.score >= tracker.begin_score) {
            return None;
        }
        if vehicle.states.iter().all(|s| frames.contains(&s.frame)) {
            return Some(vehicle);
        }
        let mut own = tracks.iter().find_map(|track| boxes_of(track, &vehicle))?;
        own.boxes.retain(|b| frames.contains(&b.frame));
        estimate(&own)
    };
    vehicles.into_iter().zip(seen).filter_map(cleaned).collect()
}

/// The frames (rows of the run) of each vehicle without a beginning and an end whose boxes are scattered and weak; `None` for a
/// track that has too few boxes besides.
///
/// Between a gap and the end of a track the scores of its boxes, zero where it was missed, must reach a mean. Frames count in which the
/// vehicle would be seen: not cut off by the image's border, not behind another vehicle, as large as when it was seen, and
/// in which anything was detected. `least_score` is what a single box must reach.
fn seen_frames(
    vehicles: &[VehicleTrajectory],
    tracks: &[Track],
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    (options, least_score): (&VehicleOptions, f64),
) -> Vec<Option<RangeInclusive<usize>>> {
    let hypothesis = &options.advanced.hypothesis;
    let least_mean = hypothesis.least_mean_score_ratio * least_score;
    let boxes = boxes_by_frame(vehicles);
    let pictures = Pictures::new(vehicles, camera, grounds);
    let seen = |(index, vehicle): (usize, &VehicleTrajectory)| {
        let mut scores = expected_scores(vehicle, &boxes, camera, hypothesis.hidden_share);
        let explained = pictures.explained((index, vehicle), tracks, camera, hypothesis.least_visible_iou);
        // A box that would look otherwise, and a second box on another vehicle, are none of this one's.
        let states = vehicle.states.iter().zip(&explained);
        for (score, (state, explained)) in scores.iter_mut().zip(states).filter(|(_, (s, _))| is_seen(s)) {
            if !*explained || vehicles.iter().any(|other| is_on((vehicle, state), other, hypothesis)) {
                *score = Some(0.0);
            }
        }
        let end = scores.len() - clutter(scores.iter().rev(), least_mean)?;
        let start = clutter(scores.iter().take(end), least_mean)?;
        let states = vehicle.states.get(start..end)?;
        let (first, last) = (states.first()?.frame, states.last()?.frame);
        let time_s = |frame: usize| grounds.get(frame).map_or(0.0, |g| g.time_s);
        let count = states.iter().filter(|s| is_seen(s)).count();
        // A vehicle that explains less than half of its boxes is none.
        let foreign = explained.get(start..end)?.iter().filter(|explained| !**explained).count();
        if 2 * foreign > count {
            return None;
        }
        let duration_s = time_s(last) - time_s(first);
        let views = independent_views(count, duration_s, options.advanced.correlation_time_s, f64::MAX);
        (views >= hypothesis.least_consistent_boxes).then_some(first..=last)
    };
    vehicles.iter().enumerate().map(seen).collect()
}

/// Number of the first scores that are clutter, each gap tried in order; `None` when all are. A score is `None` where the vehicle is
/// not expected to be seen, zero where it was missed.
fn clutter<'a>(scores: impl Iterator<Item = &'a Option<f64>>, least: f64) -> Option<usize> {
    let (mut cut, mut sum, mut count, mut gap) = (0, 0.0, 0_u32, false);
    for (k, score) in scores.enumerate() {
        let found = score.is_some_and(|s| s > 0.0);
        if gap && found && sum < least * f64::from(count) {
            (cut, sum, count) = (k, 0.0, 0);
        }
        gap = !found;
        sum += score.unwrap_or(0.0);
        count += u32::from(score.is_some());
    }
    (sum >= least * f64::from(count)).then_some(cut)
}

/// Score of each state.
fn expected_scores(
    vehicle: &VehicleTrajectory,
    boxes: &[Vec<BoundingBox>],
    camera: &PinholeCamera,
    hidden_share: f64,
) -> Vec<Option<f64>> {
    let seen = vehicle.states.iter().filter(|s| is_seen(s));
    let smallest_px = seen.filter_map(|s| s.bbox).map(|b| b.height()).fold(f64::INFINITY, f64::min);
    let expected = |state: &VehicleState| {
        let Some(bbox) = state.bbox.filter(|b| b.height() >= smallest_px) else { return false };
        let others = boxes.get(state.frame).map_or(&[][..], Vec::as_slice);
        let hidden = |other: &BoundingBox| other.y2 >= bbox.y2 && covered(&bbox, other) > hidden_share;
        !others.is_empty() && is_whole(&bbox, camera) && !others.iter().any(hidden)
    };
    let score = |state: &VehicleState| match is_seen(state) {
        true => Some(state.score),
        false => expected(state).then_some(0.0),
    };
    vehicle.states.iter().map(score).collect()
}

/// Boxes of the detector that vehicles have in each frame.
fn boxes_by_frame(vehicles: &[VehicleTrajectory]) -> Vec<Vec<BoundingBox>> {
    let last = vehicles.iter().filter_map(|v| v.states.last()).map(|s| s.frame).max();
    let mut boxes = vec![Vec::new(); last.map_or(0, |last| last + 1)];
    for state in vehicles.iter().flat_map(|v| &v.states).filter(|s| is_seen(s)) {
        boxes[state.frame].extend(state.bbox);
    }
    boxes
}

/// True when the box of a vehicle's state is a second one on another vehicle in its place. What is farther away may be hidden by it.
fn is_on(
    (vehicle, state): (&VehicleTrajectory, &VehicleState),
    other: &VehicleTrajectory,
    options: &HypothesisOptions,
) -> bool {
    let first = other.states.first().map_or(0, |s| s.frame);
    let length_m = 0.5 * (vehicle.size.length_m + other.size.length_m);
    let on = |there: &VehicleState| {
        let apart = state.world_from_vehicle.translation() - there.world_from_vehicle.translation();
        apart.norm() < length_m && is_second_box(state, there, options)
    };
    other.id != vehicle.id && state.frame.checked_sub(first).and_then(|k| other.states.get(k)).is_some_and(on)
}

fn is_seen(state: &VehicleState) -> bool {
    state.source != Source::Predicted
}

/// True for a box that the image's border does not cut.
fn is_whole(bbox: &BoundingBox, camera: &PinholeCamera) -> bool {
    bbox.x1 > 1.0 && bbox.x2 < f64::from(camera.width) - 1.0
}

/// Share of a box that lies within another one.
fn covered(bbox: &BoundingBox, other: &BoundingBox) -> f64 {
    bbox.intersection(other) / bbox.area().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, standing_car, track_of};
    use motorcade_geometry::Pose;

    use nalgebra::{UnitQuaternion, Vector3};

    const HERE: [f64; 4] = [400.0, 150.0, 480.0, 200.0];
    const ASIDE: [f64; 4] = [100.0, 150.0, 180.0, 200.0];

    /// A vehicle of 40 frames with boxes of these scores; without a box where it is zero.
    fn vehicle(bbox: [f64; 4], score: impl Fn(usize) -> f64) -> VehicleTrajectory {
        standing_car(0, 0..40, [0.0; 2]).with_box(bbox).with_scores(score)
    }

    fn every(n: usize, score: f64) -> impl Fn(usize) -> f64 {
        move |frame| if frame.is_multiple_of(n) { score } else { 0.0 }
    }

    /// The frames of the first of these vehicles.
    fn frames(vehicles: &[VehicleTrajectory]) -> Option<RangeInclusive<usize>> {
        let options = (&VehicleOptions::default(), 0.15);
        seen_frames(vehicles, &[], &CAMERA, &level_grounds(40), options).swap_remove(0)
    }

    #[test]
    fn scattered_weak_boxes_are_no_vehicle() {
        let always = vehicle(ASIDE, |_| 0.8);
        assert_eq!(frames(std::slice::from_ref(&always)), Some(0..=39));
        assert_eq!(frames(&[vehicle(HERE, every(4, 0.3)), always.clone()]), None);
        // Weak ones in most frames, and certain ones in some.
        assert_eq!(frames(&[vehicle(HERE, |_| 0.2), always.clone()]), Some(0..=39));
        assert_eq!(frames(&[vehicle(HERE, every(4, 0.8)), always]), Some(0..=36));
    }

    /// A part of a track has to be a track by itself.
    #[test]
    fn boxes_of_which_none_starts_a_track_are_no_vehicle() {
        let kept = |best: f64| {
            let car = car_ahead(0, 0.0, 20.0).with_scores(|k| if k == 4 { best } else { 0.4 });
            let (tracks, grounds) = ([track_of(&car, [true; 4])], level_grounds(10));
            let (options, tracker) = (VehicleOptions::default(), TrackerOptions::default());
            let anew = |_: &Track| None;
            without_clutter(vec![car], &tracks, &CAMERA, &grounds, (&options, &tracker), anew).len()
        };
        assert_eq!([kept(0.44), kept(0.45)], [0, 1]);
    }

    #[test]
    fn a_track_ends_with_its_vehicle() {
        let always = vehicle(ASIDE, |_| 0.8);
        let tail = |k: usize| if k < 20 { 0.6 } else { every(6, 0.2)(k) };
        assert_eq!(frames(&[vehicle(HERE, tail), always.clone()]), Some(0..=19));
        let lead = |k: usize| tail(39 - k);
        assert_eq!(frames(&[vehicle(HERE, lead), always.clone()]), Some(20..=39));
        // A gap between certain boxes, as behind a hedge.
        let gap = |k: usize| if (15..30).contains(&k) { 0.0 } else { 0.6 };
        assert_eq!(frames(&[vehicle(HERE, gap), always]), Some(0..=39));
    }

    /// The car that a track belonged to is gone; its last boxes lie on the next one.
    #[test]
    fn a_track_does_not_go_on_over_another_vehicle() {
        let moved = |k: usize| if k < 20 { ASIDE } else { HERE };
        let mut track = vehicle(HERE, |k| if k < 20 { 0.6 } else { 0.2 });
        track.states.iter_mut().for_each(|s| s.bbox = Some(BoundingBox::new(moved(s.frame))));
        let with = |score: f64| {
            let other = VehicleTrajectory { id: 1, ..vehicle(HERE, |_| score) };
            frames(&[track.clone(), other])
        };
        assert_eq!(with(0.8), Some(0..=19));
        // No surer of the other one than of this one.
        assert_eq!(with(0.3), Some(0..=39));
        // One that stands behind the other is hidden by it.
        let far = Pose::from_parts(UnitQuaternion::identity(), Vector3::z() * 20.0);
        track.states.iter_mut().for_each(|s| s.world_from_vehicle = far);
        let other = VehicleTrajectory { id: 1, ..vehicle(HERE, |_| 0.8) };
        assert_eq!(frames(&[track, other]), Some(0..=39));
    }

    #[test]
    fn frames_in_which_it_cannot_be_seen_do_not_count() {
        let scattered = || vehicle(HERE, every(4, 0.3));
        // A nearer vehicle in front of it, and one behind it.
        assert!(frames(&[scattered(), vehicle([380.0, 150.0, 500.0, 230.0], |_| 0.8)]).is_some());
        assert!(frames(&[scattered(), vehicle([380.0, 150.0, 500.0, 195.0], |_| 0.8)]).is_none());
        // Cut off by the border; perception in every fourth frame only.
        let cut_off = vehicle([0.0, 150.0, 80.0, 200.0], every(4, 0.3));
        assert!(frames(&[cut_off, vehicle(ASIDE, |_| 0.8)]).is_some());
        assert!(frames(&[scattered(), vehicle(ASIDE, every(4, 0.3))]).is_some());
    }

    #[test]
    fn boxes_that_look_otherwise_than_the_vehicle_would_there_are_no_vehicle() {
        let kept = |jumps: fn(usize) -> bool| {
            let mut car = car_ahead(0, 0.0, 20.0);
            for state in car.states.iter_mut().filter(|s| jumps(s.frame)) {
                // Half as large, beside it.
                state.bbox =
                    state.bbox.map(|b| BoundingBox::new([b.x1 - 20.0, b.y1, b.x1 + 10.0, b.y1 + 20.0]));
            }
            let (tracks, grounds) = ([track_of(&car, [true, true, false, false])], level_grounds(10));
            let options = (&VehicleOptions::default(), 0.15);
            seen_frames(&[car], &tracks, &CAMERA, &grounds, options).swap_remove(0)
        };
        assert_eq!(kept(|_| false), Some(0..=9));
        assert_eq!(kept(|k| k % 3 == 1), Some(0..=9));
        assert_eq!(kept(|k| k > 4), Some(0..=4));
        assert_eq!(kept(|k| k % 3 != 0), None);
    }
}
