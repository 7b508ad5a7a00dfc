//! The vehicles of a track: one, or several where a tracker joined their boxes.

use motorcade_geometry::PinholeCamera;

use super::background::is_background;
use super::drive::Drive;
use super::nearest::nearest_vehicle;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::observed_box::overlap;
use crate::options::VehicleOptions;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// Estimates a track as [`estimate_track`](super::estimate_track) does; boxes that no vehicle of it explains are another vehicle's. `views` gives the external views of
/// a track. With `next_id` those boxes become tracks of their own with identities from there on, as long as they are enough; without,
/// they are left out. What would have to drive faster than any vehicle is none, nor is what stands far behind the traffic.
pub fn estimate_consistently(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    views: &impl Fn(&Track) -> ExternalTrack,
    options: &VehicleOptions,
    next_id: Option<&mut usize>,
) -> Vec<VehicleTrajectory> {
    let drive = Drive { camera, grounds, views, options };
    let (mut found, mut ids) = (Vec::new(), next_id);
    // The last one first.
    let mut open = vec![(track.clone(), drive.hypothesis().splits)];
    while let Some((track, splits)) = open.pop() {
        let Some(estimate) = drive.estimate(&track) else { continue };
        if is_background(&drive, &track, &estimate) {
            continue;
        }
        // A window of the last seconds has no boxes that are far against its near ones.
        let nearest =
            if splits > 0 && ids.is_some() { nearest_vehicle(&drive, &track, &estimate) } else { None };
        let least_iou = drive.hypothesis().least_box_iou;
        let own = nearest.unwrap_or_else(|| drive.explained(overlap, &track, &estimate, least_iou));
        let foreign = own.iter().filter(|own| !**own).count();
        if foreign == 0 || splits == 0 {
            // A vehicle that explains less than half of its boxes is none.
            if 2 * foreign <= own.len() || ids.is_none() {
                found.push(estimate);
            }
            continue;
        }
        let (kept, rest) = parted(&track, &own, |boxes| drive.enough(boxes));
        match &mut ids {
            None if drive.enough(&kept) => open.push((track.with_boxes(track.id, kept), 0)),
            None => found.push(estimate),
            Some(next) => {
                let (kept, rest) = if kept.is_empty() { halves(track.boxes.clone()) } else { (kept, rest) };
                let is_one = |boxes: &[TrackBox]| drive.enough(boxes) && dense(boxes);
                for boxes in rest.into_iter().filter(|boxes| is_one(boxes)) {
                    open.push((track.with_boxes(**next, boxes), splits - 1));
                    **next += 1;
                }
                if is_one(&kept) {
                    open.push((track.with_boxes(track.id, kept), splits - 1));
                }
            }
        }
    }
    found.retain(|vehicle| mean_speed_mps(grounds, vehicle) <= options.advanced.motion.largest_speed_mps);
    found
}

/// The boxes of a track that are its own, and the others, parted where enough of its own for a vehicle lie between them: before and after the track was
/// on its vehicle again they are hardly those of one.
fn parted(
    track: &Track,
    own: &[bool],
    enough: impl Fn(&[TrackBox]) -> bool,
) -> (Vec<TrackBox>, Vec<Vec<TrackBox>>) {
    let (mut kept, mut rest): (Vec<TrackBox>, Vec<Vec<TrackBox>>) = (Vec::new(), Vec::new());
    // Own boxes before the last other one.
    let mut before = 0;
    for (b, is_own) in track.boxes.iter().zip(own) {
        if *is_own {
            kept.push(*b);
            continue;
        }
        match rest.last_mut() {
            Some(run) if !enough(&kept[before..]) => run.push(*b),
            _ => rest.push(vec![*b]),
        }
        before = kept.len();
    }
    (kept, rest)
}

/// True when the boxes of a part of a track are in at least half of its frames: scattered ones are errors of the detector.
pub(super) fn dense(boxes: &[TrackBox]) -> bool {
    let frames = boxes.first().zip(boxes.last()).map_or(0, |(first, last)| last.frame - first.frame + 1);
    2 * boxes.len() >= frames
}

/// The earlier and the later half.
fn halves(mut boxes: Vec<TrackBox>) -> (Vec<TrackBox>, Vec<Vec<TrackBox>>) {
    let later = boxes.split_off(boxes.len() / 2);
    (boxes, vec![later])
}

/// Way from the first state to the last over its time \[m/s\]; zero for a single state.
fn mean_speed_mps(grounds: &[GroundFrame], vehicle: &VehicleTrajectory) -> f64 {
    let at = |state: &crate::trajectory::VehicleState| {
        Some((grounds.get(state.frame)?.time_s, state.world_from_vehicle.translation()))
    };
    let ends = vehicle.states.first().and_then(at).zip(vehicle.states.last().and_then(at));
    ends.filter(|((from_s, _), (to_s, _))| to_s > from_s)
        .map_or(0.0, |((from_s, from), (to_s, to))| (to - from).norm() / (to_s - from_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{car_ahead, track_of};

    #[test]
    fn foreign_boxes_are_parted_by_enough_own_ones() {
        let track = track_of(&car_ahead(1, 0.0, 20.0), [true; 4]);
        let spans = |own: &str, enough: usize| -> Vec<Vec<usize>> {
            let own: Vec<bool> = own.chars().map(|c| c == 'o').collect();
            let (kept, rest) = parted(&track, &own, |boxes| boxes.len() >= enough);
            assert_eq!(kept.len(), own.iter().filter(|own| **own).count());
            rest.iter().map(|boxes| boxes.iter().map(|b| b.frame).collect()).collect()
        };
        assert_eq!(spans("fffooooffo", 4), [vec![0, 1, 2], vec![7, 8]]);
        assert_eq!(spans("fffooooffo", 5), [vec![0, 1, 2, 7, 8]]);
        // Those between two foreign ones, not all that came before.
        assert_eq!(spans("oooofofoff", 3), [vec![4, 6, 8, 9]]);
        assert!(spans("oooooooooo", 3).is_empty());
    }
}
