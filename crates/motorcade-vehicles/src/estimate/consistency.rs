//! Agreement of a vehicle's estimate with the boxes it was made from.
//!
//! A tracker that takes the box of a neighbour joins two vehicles in one track, and no trajectory explains the boxes of both. In a row
//! of parked cars such a track slides from car to car and is placed at half their distance.

use motorcade_geometry::{BoundingBox, Camera, PinholeCamera, Pose, Vehicle};

use crate::ground::GroundFrame;
use crate::observed_box::{ObservedBox, overlap};
use crate::outline::image_box;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// For each box of a track the overlap of the projected vehicle with it; 1 where the vehicle is beside the camera and has no box to compare with, 0
/// before its first state and after its last: an estimate may have left out the boxes there.
pub(super) fn overlaps(
    overlap: fn(&BoundingBox, &ObservedBox) -> f64,
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    found: &VehicleTrajectory,
) -> Vec<f64> {
    let first = found.states.first().map_or(0, |s| s.frame);
    let one = |b: &TrackBox| {
        let state = found.states.get(b.frame.checked_sub(first)?)?;
        let camera_from_vehicle =
            grounds.get(b.frame)?.world_from_camera.inverse() * state.world_from_vehicle;
        // One wholly behind the camera is not what the picture shows; one beside it has no box to compare with.
        let unseen = || {
            let reach_m = 0.5 * found.size.length_m.hypot(found.size.width_m);
            if camera_from_vehicle.translation().z > -reach_m { 1.0 } else { 0.0 }
        };
        Some(overlap_in(overlap, camera, found, &camera_from_vehicle, b).unwrap_or_else(unseen))
    };
    track.boxes.iter().map(|b| one(b).unwrap_or(0.0)).collect()
}

/// Overlap with a box of a vehicle that is there; `None` where it is not in the picture.
pub(super) fn overlap_in(
    overlap: fn(&BoundingBox, &ObservedBox) -> f64,
    camera: &PinholeCamera,
    vehicle: &VehicleTrajectory,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    seen: &TrackBox,
) -> Option<f64> {
    let (class, convention) = (vehicle.class, seen.observed.convention);
    let projected = image_box(camera, camera_from_vehicle, class, convention, &vehicle.size)?;
    Some(overlap(&projected, &seen.observed))
}

/// IoU of their columns: neighbours stand beside each other, and the road's slope moves both up and down.
pub(super) fn overlap_of_columns(projected: &BoundingBox, observed: &ObservedBox) -> f64 {
    let rows = |b: [f64; 4]| BoundingBox::new([b[0], 0.0, b[2], 1.0]);
    let columns = ObservedBox {
        bbox: rows(observed.bbox.to_array()),
        edges: [observed.edges[0], true, observed.edges[2], true],
        ..*observed
    };
    overlap(&rows(projected.to_array()), &columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, track_of};

    /// A car that a track places where the camera has passed is not what its boxes show.
    #[test]
    fn what_is_behind_the_camera_explains_no_box() {
        let grounds = level_grounds(10);
        let shown = track_of(&car_ahead(1, 0.0, 20.0), [true; 4]);
        let explained_by = |z_m: f64| {
            let found = car_ahead(1, 0.0, z_m);
            overlaps(overlap, &CAMERA, &grounds, &shown, &found).into_iter().all(|own| own >= 0.3)
        };
        assert!(explained_by(20.0) && !explained_by(40.0) && !explained_by(-8.0));
        // Beside the camera it has no box to compare with.
        assert!(explained_by(0.5));
    }

    #[test]
    fn boxes_without_a_state_are_not_explained() {
        let mut found = car_ahead(1, 0.0, 20.0);
        let shown = track_of(&found, [true; 4]);
        found.states.retain(|s| (3..7).contains(&s.frame));
        let overlaps = overlaps(overlap, &CAMERA, &level_grounds(10), &shown, &found);
        let explained: Vec<bool> = overlaps.into_iter().map(|own| own > 0.3).collect();
        assert_eq!(explained, (0..10).map(|frame| (3..7).contains(&frame)).collect::<Vec<_>>());
    }
}
