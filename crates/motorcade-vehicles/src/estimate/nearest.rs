//! The vehicle in the nearest boxes of a track, where it stands.
//!
//! Far boxes in a row of parked vehicles are often a neighbour's. They are small and determine the distance badly, but their direction
//! weighs as much as that of near ones. The near boxes alone place a standing vehicle well, and show which of the far ones are its own.

use super::consistency::overlap_of_columns;
use super::drive::Drive;
use crate::external::ExternalTrack;
use crate::track::{Track, TrackBox};
use crate::trajectory::{VehicleState, VehicleTrajectory};

/// For each box of a track whether it is the vehicle's that the nearest boxes show; `None` where that moves, where nearly all boxes are
/// its own, or where the track as one vehicle, `whole`, drives and explains more of them.
pub(super) fn nearest_vehicle<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    track: &Track,
    whole: &VehicleTrajectory,
) -> Option<Vec<bool>> {
    let near = near_boxes(drive, track);
    if !drive.enough(&near) || near.len() == track.boxes.len() {
        return None;
    }
    let found = drive.estimate(&track.with_boxes(track.id, near)).filter(|found| !drive.moves(found))?;
    let least_iou = drive.hypothesis().least_standing_iou;
    let own = drive.explained(overlap_of_columns, track, &held(&found, track)?, least_iou);
    let explains = count(&own);
    let driving = || count(&drive.explained(overlap_of_columns, track, whole, least_iou));
    if drive.moves(whole) && driving() > explains {
        return None;
    }
    let foreign = (own.len() - explains) as f64;
    (foreign > drive.hypothesis().most_foreign_share * own.len() as f64).then_some(own)
}

/// The boxes that are high against the largest one.
fn near_boxes<V: Fn(&Track) -> ExternalTrack>(drive: &Drive<'_, V>, track: &Track) -> Vec<TrackBox> {
    let hypothesis = drive.hypothesis();
    let height_px = |b: &TrackBox| b.observed.bbox.height();
    let largest_px = track.boxes.iter().map(height_px).fold(0.0, f64::max);
    let least_px = hypothesis.near_share * largest_px.min(hypothesis.near_rad * drive.camera.fy);
    track.boxes.iter().filter(|b| height_px(b) >= least_px).copied().collect()
}

fn count(of: &[bool]) -> usize {
    of.iter().filter(|one| **one).count()
}

/// A standing vehicle at its place in all frames of a track.
fn held(found: &VehicleTrajectory, track: &Track) -> Option<VehicleTrajectory> {
    let (first, last) = (track.boxes.first()?.frame, track.boxes.last()?.frame);
    let middle = found.states.get(found.states.len() / 2)?;
    let state = |frame: usize| VehicleState { frame, ..middle.clone() };
    Some(VehicleTrajectory { states: (first..=last).map(state).collect(), ..found.clone() })
}
