//! Drives with exact poses.

use std::ops::Range;

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

/// A drive on a level road; the world is the first camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Times, multiples of the frame interval rounded to nanoseconds \[s\].
    pub times_s: Vec<f64>,
    /// Camera poses \[m\].
    pub world_from_camera: Vec<Pose<World, Camera>>,
}

impl Drive {
    /// Straight ahead.
    pub fn straight(frames: usize, fps: f64, speed_mps: f64) -> Self {
        Self::turning(frames, fps, speed_mps, 0.0, 0.0..0.0)
    }

    /// At constant speed, turning left at a rate within an interval of time \[s\]; exact arcs, so that drives at several frame rates
    /// are samples of one motion.
    pub fn turning(
        frames: usize,
        fps: f64,
        speed_mps: f64,
        yaw_rate_radps: f64,
        interval_s: Range<f64>,
    ) -> Self {
        let times_s: Vec<f64> = (0..frames).map(|k| (k as f64 / fps * 1e9).round() * 1e-9).collect();
        let pose = |t: &f64| {
            let before = t.min(interval_s.start);
            let turned_s = (t - interval_s.start).clamp(0.0, interval_s.end - interval_s.start);
            let after = t - before - turned_s;
            let yaw = yaw_rate_radps * turned_s;
            // Integral of (−sin, 0, cos) of the yaw: to the left is −x.
            let arc = if yaw.abs() < 1e-12 {
                Vector3::new(0.0, 0.0, turned_s)
            } else {
                Vector3::new(yaw.cos() - 1.0, 0.0, yaw.sin()) / yaw_rate_radps
            };
            let heading = Vector3::new(-yaw.sin(), 0.0, yaw.cos());
            let position = (Vector3::z() * before + arc + heading * after) * speed_mps;
            Pose::from_parts(UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -yaw), position)
        };
        let world_from_camera = times_s.iter().map(pose).collect();
        Self { times_s, world_from_camera }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_driven_along_the_heading() {
        let drive = Drive::turning(2000, 500.0, 10.0, 0.3, 1.0..3.0);
        for pair in drive.world_from_camera.windows(2) {
            let step = (pair[0].inverse() * pair[1]).translation();
            assert!((step.norm() - 0.02).abs() < 1e-6 && step.z > 0.02 - 1e-5, "{step}");
        }
        let ahead = drive.world_from_camera[1999].transform_vector(&Vector3::z());
        assert!((ahead - Vector3::new(-0.6_f64.sin(), 0.0, 0.6_f64.cos())).norm() < 1e-9, "to the left");
    }
}
