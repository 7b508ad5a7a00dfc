//! Agreement of a vehicle's estimate with the boxes it was made from.
//!
//! A tracker that takes the box of a neighbour joins two vehicles in one track, and no trajectory explains the boxes of both. In a row
//! of parked cars such a track slides from car to car and is placed at half their distance.

use motorcade_geometry::{BoundingBox, Camera, PinholeCamera, Pose, Vehicle};

use crate::ground::GroundFrame;
use crate::observed_box::{ObservedBox, inside_border, overlap};
use crate::outline::image_box;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// Distance from the border of the picture up to which a box ends there, as a share of its width: detectors end boxes short of it.
const BORDER_SHARE: f64 = 0.1;

/// For each box of a track the overlap of the projected vehicle with it; where the vehicle is beside the camera and has no box to compare with, 1 for a box
/// at the border on its side and 0 for others; 0 before its first state and after its last: an estimate may have left out the boxes there.
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
        let beside =
            || if may_show_beside(camera, found, &camera_from_vehicle, &b.observed.bbox) { 1.0 } else { 0.0 };
        Some(overlap_in(overlap, camera, found, &camera_from_vehicle, b).unwrap_or_else(beside))
    };
    track.boxes.iter().map(|b| one(b).unwrap_or(0.0)).collect()
}

/// True when a box may show a vehicle of which a part is beside or behind the camera: its rest reaches the border of the picture on its side, or, right
/// ahead, the lower one. One wholly behind the camera is not what the picture shows.
fn may_show_beside(
    camera: &PinholeCamera,
    vehicle: &VehicleTrajectory,
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    seen: &BoundingBox,
) -> bool {
    let reach_m = 0.5 * vehicle.size.length_m.hypot(vehicle.size.width_m);
    let place = camera_from_vehicle.translation();
    let [left, _, right, bottom] = inside_border(seen, camera, BORDER_SHARE * seen.width());
    let inside = if place.x < 0.0 { left } else { right };
    place.z > -reach_m && !(inside && bottom)
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
        // Nor is one beside the camera what a box in the middle of the picture shows; its rest ends at the border.
        assert!(!explained_by(0.5));
        let width = f64::from(CAMERA.width);
        let beside = |x_m: f64, bbox: [f64; 4]| {
            let found = car_ahead(1, x_m, 1.0).with_box(bbox);
            overlaps(overlap, &CAMERA, &grounds, &track_of(&found, [true; 4]), &found)
                .into_iter()
                .all(|own| own >= 0.3)
        };
        let (left, right) = ([0.0, 150.0, 300.0, 300.0], [width - 300.0, 150.0, width - 5.0, 300.0]);
        assert!(beside(-2.5, left) && beside(2.5, right));
        assert!(!beside(-2.5, right) && !beside(2.5, left));
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
