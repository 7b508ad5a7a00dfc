//! Estimates in rerun's types.

use motorcade::{Estimate, VehicleEstimate};
use motorcade_geometry::PinholeCamera;
use motorcade_viewer::{MOVING, hue, rgb};
use nalgebra::{UnitQuaternion, Vector3};
use rerun::{Boxes3D, Color, LineStrips3D, Pinhole, Quaternion, Transform3D};

pub fn pinhole(camera: &PinholeCamera) -> Pinhole {
    Pinhole::from_focal_length_and_resolution(
        [camera.fx as f32, camera.fy as f32],
        [camera.width as f32, camera.height as f32],
    )
    .with_principal_point([camera.cx as f32, camera.cy as f32])
    .with_camera_xyz(rerun::components::ViewCoordinates::RDF)
}

pub fn camera(estimate: &Estimate) -> Transform3D {
    let pose = &estimate.ego.world_from_camera;
    Transform3D::from_translation_rotation(point(&pose.translation()), quaternion(&pose.rotation()))
}

pub fn path<'a>(points: impl IntoIterator<Item = &'a Vector3<f64>>) -> LineStrips3D {
    LineStrips3D::new([points.into_iter().map(point).collect::<Vec<_>>()])
}

/// Boxes around the vehicles, whose origin is on the road below their middle.
pub fn vehicles(vehicles: &[VehicleEstimate]) -> Boxes3D {
    let centre = |v: &VehicleEstimate| {
        let pose = &v.state.world_from_vehicle;
        point(&(pose.translation() + pose.rotation() * Vector3::new(0.0, 0.0, 0.5 * v.size.height_m)))
    };
    let half =
        |v: &VehicleEstimate| point(&(0.5 * Vector3::new(v.size.length_m, v.size.width_m, v.size.height_m)));
    let label = |v: &VehicleEstimate| {
        if v.p_moving > MOVING {
            format!("{} {} {:.0} km/h", v.id, v.class, 3.6 * v.state.speed_mps)
        } else {
            format!("{} {} parked", v.id, v.class)
        }
    };
    Boxes3D::from_centers_and_half_sizes(vehicles.iter().map(centre), vehicles.iter().map(half))
        .with_quaternions(vehicles.iter().map(|v| quaternion(&v.state.world_from_vehicle.rotation())))
        .with_colors(vehicles.iter().map(colour))
        .with_labels(vehicles.iter().map(label))
}

/// The colour of an identity.
fn colour(vehicle: &VehicleEstimate) -> Color {
    let [r, g, b] = rgb(hue(vehicle.id), vehicle.p_moving > MOVING).map(|v| (255.0 * v) as u8);
    Color::from_rgb(r, g, b)
}

fn point(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}
