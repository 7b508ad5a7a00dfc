//! Vertical curvature of the road from the trajectory of the camera over it.

use nalgebra::{Matrix3, Vector3};

use super::options::ProfileOptions;
use super::plane::road_normal;
use super::state::RoadState;
use crate::time::nanoseconds;
use crate::trajectory::OdometryTrajectory;

/// Vertical curvature of the road times the camera's height, positive at the foot of a hill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Curvature {
    pub value: f64,
    pub sigma: f64,
}

/// Curvature of the road ahead of a frame, by least squares through the camera's trajectory: `up = a + b s + κ/2 s²` over the
/// distance s. `road` is height and tilt in that frame. `None` where the pose is not known.
pub(super) fn driven_curvature(
    trajectory: &OdometryTrajectory,
    frame: usize,
    road: &RoadState,
    options: &ProfileOptions,
) -> Option<Curvature> {
    let camera_from_world = trajectory.camera_from_world(frame)?;
    let segment = trajectory.frames[frame].segment;
    let (per_height, up) = (road.log_inverse_height.exp(), road_normal(road.pitch_rad, road.roll_rad));
    // Distance, height above the frame, and lateral offset [camera heights].
    let position = |k: usize| -> Option<[f64; 3]> {
        let record = trajectory.frames.get(k).filter(|r| r.segment == segment)?;
        let world_from_camera =
            trajectory.camera_from_world(k).filter(|_| record.segment != usize::MAX)?.inverse();
        let p =
            camera_from_world.transform_point(&world_from_camera.translation().into()).coords * per_height;
        let height = p.dot(&up);
        Some([(p.norm_squared() - height * height).max(0.0).sqrt(), height, p.x])
    };
    let mut h = Matrix3::from_diagonal(&Vector3::new(
        options.line_information,
        options.line_information,
        options.curvature_sigma.powi(-2),
    ));
    let mut g = Vector3::zeros();
    let interval_ns = nanoseconds(options.interval_s);
    for (sign, frames) in [
        (1.0, Box::new(frame + 1..trajectory.frames.len()) as Box<dyn Iterator<Item = usize>>),
        (-1.0, Box::new((0..frame).rev())),
    ] {
        let mut before = 0.0;
        let mut last_ns = trajectory.frames[frame].timestamp_ns;
        let spaced = frames.filter(|k| {
            let timestamp_ns = trajectory.frames[*k].timestamp_ns;
            let far = (timestamp_ns - last_ns).abs() >= interval_ns;
            if far {
                last_ns = timestamp_ns;
            }
            far
        });
        for [s, height, aside] in spaced.map_while(position).take_while(|[s, ..]| *s < options.reach_heights)
        {
            // One independent observation per camera height driven, at any frame rate.
            let independent = (s - before).clamp(0.0, 1.0);
            before = s;
            let change = if sign < 0.0 { 0.5 * options.change_sigma * s * s } else { 0.0 };
            let row = Vector3::new(1.0, sign * s, 0.5 * s * s);
            let rolled = options.roll_sigma_rad * aside;
            let unevenness = options.unevenness_heights;
            let weight = independent / (unevenness * unevenness + change * change + rolled * rolled);
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
    use crate::trajectory::ExternalTrajectoryOptions;
    use motorcade_geometry::{Camera, Pose, World};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    /// Trajectory over a road of constant curvature, camera 2 units high, a unit per frame, in the odometry's unit.
    fn drive(curvature: f64, frames: usize) -> OdometryTrajectory {
        let pose = |k: usize| -> Pose<World, Camera> {
            let angle = k as f64 * curvature;
            let (y, z) = ((angle.cos() - 1.0) / curvature, angle.sin() / curvature);
            // y points down, a positive curvature leads up.
            Pose::new(Isometry3::from_parts(
                Translation3::new(0.0, y, z),
                UnitQuaternion::from_euler_angles(angle, 0.0, 0.0),
            ))
        };
        let poses: Vec<Pose<World, Camera>> = (0..frames).map(pose).collect();
        let timestamps_ns: Vec<i64> = (0..frames as i64).map(|k| k * 100_000_000).collect();
        OdometryTrajectory::from_poses(&poses, &timestamps_ns, &ExternalTrajectoryOptions::default())
    }

    #[test]
    fn the_trajectory_determines_the_curvature() {
        let state = RoadState { log_inverse_height: 0.5_f64.ln(), pitch_rad: 0.0, roll_rad: 0.0 };
        let options = ProfileOptions::default();
        for curvature in [1e-3, -1e-3] {
            let odometry = drive(curvature, 80);
            let found = driven_curvature(&odometry, 30, &state, &options).unwrap();
            // κ · height
            assert!((found.value - 2.0 * curvature).abs() < 3e-5, "{found:?}");
            assert!(found.sigma < 5e-4, "{found:?}");
            // At the end only the trajectory behind is known.
            let last = driven_curvature(&odometry, 79, &state, &options).unwrap();
            assert!(
                last.sigma > found.sigma && (last.value - 2.0 * curvature).abs() < last.sigma,
                "{last:?}"
            );
        }
        // Two frames are not informative.
        assert!(driven_curvature(&drive(1e-3, 2), 1, &state, &options).unwrap().sigma > 3e-3);
    }
}
