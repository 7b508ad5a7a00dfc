//! The camera in the columns of KITTI's oxts files.

use std::fmt::Write;

use nalgebra::Vector3;

use super::position_sigma_m;
use crate::anchor::Placed;

/// Standard deviation of a speed that is not known at all \[m/s\]: traffic.
const UNKNOWN_SPEED_SIGMA_MPS: f64 = 15.0;

/// One line a frame with the 30 values of KITTI raw (Geiger et al., 2013), separated by spaces: latitude, longitude \[deg\], altitude
/// \[m\], roll, pitch, yaw \[rad\] (yaw 0 east, counter-clockwise), velocities north, east, forward, left, up \[m/s\], and from there on
/// what a camera does not measure: accelerations and rates are 0. Then the standard deviation of the position \[m\] and of the speed
/// \[m/s\], and five counters of the receiver, which are 0.
pub fn oxts(placed: &Placed<'_>) -> String {
    let frames = &placed.run.frames;
    let mut out = String::new();
    for (k, frame) in frames.iter().enumerate() {
        let at = placed.place(&frame.world_from_camera.translation());
        let forward = placed.direction(&frame.world_from_camera, &Vector3::z());
        let right = placed.direction(&frame.world_from_camera, &Vector3::x());
        let (yaw, pitch) = (forward.y.atan2(forward.x), -forward.z.clamp(-1.0, 1.0).asin());
        let roll = -right.z.clamp(-1.0, 1.0).asin();
        // The direction is that of the way between the frames before and after, the length that of `speeds.csv`.
        let (a, b) = (k.saturating_sub(1), (k + 1).min(frames.len() - 1));
        let point = |k: usize| placed.local(&frames[k].world_from_camera.translation());
        let way = (point(b) - point(a)).try_normalize(1e-3).unwrap_or_default();
        let velocity = way * frame.speed_mps;
        let level = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
        let left = Vector3::new(-yaw.sin(), yaw.cos(), 0.0);
        let sigma_m = position_sigma_m(frame);
        let values = [velocity.y, velocity.x, velocity.dot(&level), velocity.dot(&left), velocity.z];
        let _ = write!(
            out,
            "{:.9} {:.9} {:.4} {roll:.7} {pitch:.7} {yaw:.7}",
            at.latitude_deg, at.longitude_deg, at.altitude_m
        );
        for value in values {
            let _ = write!(out, " {value:.5}");
        }
        out.push_str(&" 0".repeat(12));
        let _ = writeln!(
            out,
            " {sigma_m:.4} {:.4} 0 0 0 0 0",
            frame.speed_sigma_mps.unwrap_or(UNKNOWN_SPEED_SIGMA_MPS)
        );
    }
    out
}
