//! The vehicles of a track: one, or several where a tracker joined their boxes.

use motorcade_geometry::{BoundingBox, PinholeCamera};

use super::consistency::{explained, overlap, parted};
use super::estimate_track;
use super::nearest::nearest_vehicle;
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::{HypothesisOptions, VehicleOptions};
use crate::time::independent_views;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// Estimates a track as [`estimate_track`] does; boxes that no vehicle of it explains are another vehicle's. `views` gives the external views of
/// a track. With `next_id` those boxes become tracks of their own with identities from there on, as long as they are enough; without,
/// they are left out. What would have to drive faster than any vehicle is none.
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
        let (kept, rest) = parted(&track, &own);
        match &mut ids {
            None if drive.enough(&kept) => open.push((track.with_boxes(track.id, kept), 0)),
            None => found.push(estimate),
            Some(next) => {
                let (kept, rest) = if kept.is_empty() { halves(rest) } else { (kept, rest) };
                if drive.enough(&rest) && dense(&rest) {
                    open.push((track.with_boxes(**next, rest), splits - 1));
                    **next += 1;
                }
                if drive.enough(&kept) && dense(&kept) {
                    open.push((track.with_boxes(track.id, kept), splits - 1));
                }
            }
        }
    }
    found.retain(|vehicle| mean_speed_mps(grounds, vehicle) <= options.advanced.motion.largest_speed_mps);
    found
}

/// What is known of a drive when the vehicles of a track are estimated.
pub(super) struct Drive<'a, V> {
    pub(super) camera: &'a PinholeCamera,
    grounds: &'a [GroundFrame],
    views: &'a V,
    options: &'a VehicleOptions,
}

impl<V: Fn(&Track) -> ExternalTrack> Drive<'_, V> {
    pub(super) fn hypothesis(&self) -> &HypothesisOptions {
        &self.options.advanced.hypothesis
    }

    /// The estimate of a track as one vehicle.
    pub(super) fn estimate(&self, track: &Track) -> Option<VehicleTrajectory> {
        estimate_track(self.camera, self.grounds, track, &(self.views)(track), self.options)
    }

    /// For each box of a track whether a vehicle overlaps it by `least_iou`.
    pub(super) fn explained(
        &self,
        overlap: fn(&BoundingBox, &ObservedBox) -> f64,
        track: &Track,
        vehicle: &VehicleTrajectory,
        least_iou: f64,
    ) -> Vec<bool> {
        explained(overlap, self.camera, self.grounds, track, vehicle, least_iou)
    }

    /// True when boxes are enough for a vehicle.
    pub(super) fn enough(&self, boxes: &[TrackBox]) -> bool {
        let time_s =
            |b: Option<&TrackBox>| b.and_then(|b| self.grounds.get(b.frame)).map_or(0.0, |g| g.time_s);
        let duration_s = time_s(boxes.last()) - time_s(boxes.first());
        let correlation_time_s = self.options.advanced.correlation_time_s;
        let independent = independent_views(boxes.len(), duration_s, correlation_time_s, f64::MAX);
        independent >= self.hypothesis().least_consistent_boxes
    }
}

/// True when the boxes of a part of a track are in at least half of its frames: scattered ones are errors of the detector.
fn dense(boxes: &[TrackBox]) -> bool {
    let frames = boxes.first().zip(boxes.last()).map_or(0, |(first, last)| last.frame - first.frame + 1);
    2 * boxes.len() >= frames
}

/// The earlier and the later half.
fn halves(mut boxes: Vec<TrackBox>) -> (Vec<TrackBox>, Vec<TrackBox>) {
    let later = boxes.split_off(boxes.len() / 2);
    (boxes, later)
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
