//! Ground truth of a frame as KITTI labels.

use motorcade_dataset::Label;
use motorcade_geometry::{Camera, Pose, Vehicle};
use motorcade_perception::{BoundingBox, BoxConvention};
use motorcade_vehicles::image_box;
use nalgebra::Vector3;

use crate::drive::Drive;
use crate::render::VehicleView;

/// Least number of visible quarter pixels of a labelled vehicle.
const FEWEST_SAMPLES: u64 = 60;

/// Labels of the vehicles that can be seen in a frame. Boxes are drawn around the corners of the 3D box, clipped to the image, as
/// KITTI's; truncation is the share of the unclipped box outside the image.
pub(crate) fn of_frame(drive: &Drive, frame: usize, views: &[VehicleView]) -> Vec<Label> {
    let camera = drive.camera();
    let mut labels = Vec::new();
    for (i, (vehicle, view)) in drive.vehicles.iter().zip(views).enumerate() {
        if view.visible_samples < FEWEST_SAMPLES {
            continue;
        }
        let (Some(pose), Some(seen)) = (drive.camera_from_vehicle(i, frame), view.visible_px) else {
            continue;
        };
        let (bbox, truncated) =
            match image_box(&camera, &pose, vehicle.class, BoxConvention::ProjectedCuboid, &vehicle.size) {
                Some(whole) => {
                    let inside = whole.clipped(camera.width, camera.height);
                    (inside, 1.0 - inside.area() / whole.area().max(1e-9))
                }
                // Partly behind the camera: the box is that of the visible part, and truncated.
                None => (BoundingBox::new(seen).clipped(camera.width, camera.height), 0.9),
            };
        let [x, y, z] = pose.translation().into();
        let ry_rad = ry(&pose);
        labels.push(Label {
            frame: frame as u64,
            track: i64::from(vehicle.id),
            class: vehicle.label().to_owned(),
            // Hundredths as in KITTI's files; less is no truncation.
            truncated: (100.0 * truncated.clamp(0.0, 1.0)).round() / 100.0,
            occluded: occlusion(view.visible_share()),
            alpha_rad: wrapped(ry_rad - x.atan2(z)),
            bbox,
            size_hwl_m: [vehicle.size.height_m, vehicle.size.width_m, vehicle.size.length_m],
            location_m: [x, y, z],
            ry_rad,
            score: None,
        });
    }
    labels
}

/// Rotation about camera y: 0 when the vehicle's nose points along camera x.
fn ry(camera_from_vehicle: &Pose<Camera, Vehicle>) -> f64 {
    let nose = camera_from_vehicle.transform_vector(&Vector3::x());
    (-nose.z).atan2(nose.x)
}

/// KITTI's steps: 0 fully visible, 1 partly, 2 largely hidden.
fn occlusion(visible_share: f64) -> f64 {
    match visible_share {
        share if share >= 0.9 => 0.0,
        share if share >= 0.45 => 1.0,
        _ => 2.0,
    }
}

fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn a_car_that_drives_away_has_the_heading_kitti_gives_it() {
        // Columns: nose along camera z, left along −x, up along −y.
        let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
        let pose = Pose::from_matrix(&rotation, &Vector3::new(0.0, 1.65, 10.0));
        assert!((ry(&pose) + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}
