//! How the road is curved, from the way the camera took over it: the road ahead is where the camera will be.

use nalgebra::{Matrix3, Vector3};

use super::measurement::road_normal;
use crate::trajectory::OdometryTrajectory;

/// Vertical curvature of the road times the camera's height, positive at the foot of a hill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Curvature {
    pub value: f64,
    pub sigma: f64,
}

/// How far the way is looked at, ahead and back \[camera heights\]: as far as road is aligned.
const REACH_HEIGHTS: f64 = 15.0;
/// How far the body heaves and the road is uneven over one camera height driven \[camera heights\]: 1.6 cm for a car.
const UNEVEN: f64 = 0.01;
/// Curvature behind the camera is not that ahead of it: standard deviation of the difference.
const CHANGES: f64 = 5e-4;
/// How well the road's roll is known \[rad\]: in a curvature the way leads aside, and a roll looks like a hill.
const ROLL_RAD: f64 = 0.01;
/// Streets have 0.004 at most: a crest of 400 m radius under a car's camera.
const STEEPEST: f64 = 4e-3;

/// Curvature of the road ahead of a frame, by least squares through the camera's way: `up = a + b s + κ/2 s²` over the
/// distance s. `value` is `[log 1/height, pitch, roll]` of the road in that frame. `None` where the way is not known.
pub(crate) fn driven_curvature(
    odometry: &OdometryTrajectory,
    frame: usize,
    value: &Vector3<f64>,
) -> Option<Curvature> {
    let camera_from_world = odometry.camera_from_world(frame)?;
    let segment = odometry.frames[frame].segment;
    let (per_height, up) = (value.x.exp(), road_normal(value.y, value.z));
    // Distance, height above here, and how far to the side.
    let place = |k: usize| -> Option<[f64; 3]> {
        let record = odometry.frames.get(k).filter(|r| r.segment == segment)?;
        let world_from_camera =
            odometry.camera_from_world(k).filter(|_| record.segment != usize::MAX)?.inverse();
        let p =
            camera_from_world.transform_point(&world_from_camera.translation().into()).coords * per_height;
        let height = p.dot(&up);
        Some([(p.norm_squared() - height * height).max(0.0).sqrt(), height, p.x])
    };
    // Offset, slope, curvature: a tenth each of height and of slope, and what streets have.
    let mut h = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, STEEPEST.powi(-2)));
    let mut g = Vector3::zeros();
    for (sign, frames) in [
        (1.0, Box::new(frame + 1..odometry.frames.len()) as Box<dyn Iterator<Item = usize>>),
        (-1.0, Box::new((0..frame).rev())),
    ] {
        let mut before = 0.0;
        for [s, height, aside] in frames.map_while(place).take_while(|[s, ..]| *s < REACH_HEIGHTS) {
            // One independent look a camera height, however many frames there are.
            let looks = (s - before).clamp(0.0, 1.0);
            before = s;
            let changed = if sign < 0.0 { 0.5 * CHANGES * s * s } else { 0.0 };
            let row = Vector3::new(1.0, sign * s, 0.5 * s * s);
            let rolled = ROLL_RAD * aside;
            let weight = looks / (UNEVEN * UNEVEN + changed * changed + rolled * rolled);
            h += row * row.transpose() * weight;
            g += row * (weight * height);
        }
    }
    let covariance = h.try_inverse()?;
    Some(Curvature { value: (covariance * g).z, sigma: covariance[(2, 2)].sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::{Camera, Pose, World};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    /// A way over a road of constant curvature, camera 2 units high, a unit a frame, in the odometry's unit.
    fn way(curvature: f64, frames: usize) -> OdometryTrajectory {
        let pose = |k: usize| -> Pose<World, Camera> {
            let angle = k as f64 * curvature;
            let (y, z) = ((angle.cos() - 1.0) / curvature, angle.sin() / curvature);
            // Curvature is that of the camera's way; y points down, a positive curvature leads up.
            Pose::new(Isometry3::from_parts(
                Translation3::new(0.0, y, z),
                UnitQuaternion::from_euler_angles(angle, 0.0, 0.0),
            ))
        };
        let poses: Vec<Pose<World, Camera>> = (0..frames).map(pose).collect();
        OdometryTrajectory::from_poses(&poses)
    }

    #[test]
    fn the_way_tells_the_curvature() {
        let value = Vector3::new((0.5_f64).ln(), 0.0, 0.0);
        for curvature in [1e-3, -1e-3] {
            let odometry = way(curvature, 80);
            let found = driven_curvature(&odometry, 30, &value).unwrap();
            // κ · height
            assert!((found.value - 2.0 * curvature).abs() < 3e-5, "{found:?}");
            assert!(found.sigma < 5e-4, "{found:?}");
            // At the end of the way only what lies behind is known.
            let last = driven_curvature(&odometry, 79, &value).unwrap();
            assert!(
                last.sigma > found.sigma && (last.value - 2.0 * curvature).abs() < last.sigma,
                "{last:?}"
            );
        }
        // Two frames tell nothing.
        assert!(driven_curvature(&way(1e-3, 2), 1, &value).unwrap().sigma > 3e-3);
    }
}
