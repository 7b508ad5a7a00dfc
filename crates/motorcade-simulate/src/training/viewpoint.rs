//! Poses of training cameras relative to a vehicle.

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Matrix3, Point2, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::motion::{Road, axes};
use crate::site::Site;
use crate::vehicle::SimulatedVehicle;

/// Heights of the vehicle in the picture \[px\].
const HEIGHT_PX: (f64, f64) = (20.0, 400.0);

/// A camera and its pose.
#[derive(Clone, Debug)]
pub(super) struct Viewpoint {
    pub camera: PinholeCamera,
    pub site_from_camera: Pose<Site, Camera>,
}

/// A camera with a vehicle in view; `None` when it would be inside another one.
pub(super) fn viewpoint_of(
    road: &Road,
    vehicles: &[SimulatedVehicle],
    target: usize,
    rng: &mut ChaCha8Rng,
) -> Option<Viewpoint> {
    let vehicle = vehicles.get(target)?;
    let at = (*vehicle.poses.first()?)?.translation();
    let centre = Point2::new(at.x, at.y);
    let camera = lens(rng);
    let high = if rng.random_bool(0.7) { 260.0 } else { HEIGHT_PX.1 };
    let box_px = HEIGHT_PX.0 * (high / HEIGHT_PX.0).powf(rng.random());
    // Distance to the nearer end of the vehicle: half a length less.
    let distance_m = (camera.fy * vehicle.size.height_m / box_px).max(1.2) + 0.35 * vehicle.size.length_m;
    let eye = stand(road, &centre, distance_m, rng);
    let free = |v: &SimulatedVehicle| {
        let other = v.poses.first().copied().flatten().map(|p| p.translation());
        other.is_none_or(|p| (Point2::new(p.x, p.y) - eye).norm() > 0.5 * v.size.length_m + 0.5)
    };
    if !vehicles.iter().all(free) {
        return None;
    }
    let height_m =
        if rng.random_bool(0.7) { rng.random_range(1.15..1.9) } else { rng.random_range(1.0..3.5) };
    let towards = centre - eye;
    let width_px = camera.fx * vehicle.size.length_m.min(3.0) / distance_m;
    let half = 0.5 * f64::from(camera.width);
    // Columns from the middle; some vehicles are truncated by a side of the picture.
    let column = if rng.random_bool(0.24) {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        side * (half + rng.random_range(-0.7..0.45) * width_px)
    } else {
        rng.random_range(-0.9..0.9) * (half - 0.6 * width_px).max(0.1 * half)
    };
    let yaw = towards.y.atan2(towards.x) + (column / camera.fx).atan();
    let site_from_camera = tilted(
        (eye, road.surface(&eye).0 + height_m),
        yaw,
        rng.random_range(-0.035..0.035),
        0.012 * (rng.random::<f64>() + rng.random::<f64>() + rng.random::<f64>() - 1.5) * 2.0,
    );
    Some(Viewpoint { camera, site_from_camera })
}

/// Pictures of many shapes and fields of view.
fn lens(rng: &mut ChaCha8Rng) -> PinholeCamera {
    let focal: f64 = 450.0 * (1600.0_f64 / 450.0).powf(rng.random());
    let focal = if rng.random_bool(0.4) { rng.random_range(680.0..760.0) } else { focal };
    let (width, height) = (focal * rng.random_range(1.2..2.1), focal * rng.random_range(0.45..1.1));
    let (cx, cy) = (width * rng.random_range(0.46..0.54) - 0.5, height * rng.random_range(0.38..0.58) - 0.5);
    PinholeCamera { fx: focal, fy: focal, cx, cy, width: width as u32, height: height as u32 }
}

/// A position at a distance: on the road looking along it, or anywhere.
fn stand(road: &Road, centre: &Point2<f64>, distance_m: f64, rng: &mut ChaCha8Rng) -> Point2<f64> {
    if rng.random_bool(0.65) {
        let (s, d) = road.locate(centre);
        let lane = rng.random_range(-1.0..1.0) * (road.half_width_m - 1.0).min(4.0);
        let along = (distance_m.powi(2) - (lane - d).powi(2)).max(0.0).sqrt();
        if along > 0.5 * distance_m {
            return road.point(s + if rng.random_bool(0.5) { along } else { -along }, lane).xy();
        }
    }
    let (out, _) = axes(rng.random_range(0.0..std::f64::consts::TAU));
    centre + out * distance_m
}

/// `site_from_camera` at a position and height, with yaw `yaw_rad`, pitch downwards and roll.
fn tilted((eye, z): (Point2<f64>, f64), yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> Pose<Site, Camera> {
    let (s, c) = yaw_rad.sin_cos();
    let forward = Vector3::new(c * pitch_rad.cos(), s * pitch_rad.cos(), -pitch_rad.sin());
    let right = Vector3::new(s, -c, 0.0);
    let level = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let roll = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), roll_rad);
    Pose::from_matrix(&(level * roll.into_inner()), &Vector3::new(eye.x, eye.y, z))
}
