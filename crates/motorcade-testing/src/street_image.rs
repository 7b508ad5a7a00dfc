//! Images of a street between two walls.

use image::{GrayImage, Luma};
use motorcade_geometry::PinholeCamera;

/// A small camera, so that debug builds of the front end keep up.
pub const CAMERA: PinholeCamera =
    PinholeCamera { fx: 390.0, fy: 390.0, cx: 240.0, cy: 105.0, width: 480, height: 240 };
/// The same camera at half the size, so that drives of thousands of frames take seconds.
pub const HALF_CAMERA: PinholeCamera = PinholeCamera {
    fx: 0.5 * CAMERA.fx,
    fy: 0.5 * CAMERA.fy,
    cx: 0.5 * CAMERA.cx,
    cy: 0.5 * CAMERA.cy,
    width: CAMERA.width / 2,
    height: CAMERA.height / 2,
};
/// Height of the camera above the road \[m\].
pub const HEIGHT_M: f64 = 1.5;
/// From the middle of the street to either wall \[m\].
const TO_WALL_M: f64 = 6.0;
/// Range of sight \[m\].
const SIGHT_M: f64 = 60.0;

/// Pose of the camera above the street.
#[derive(Clone, Copy, Debug, Default)]
pub struct StreetPose {
    /// Offset to the right of the middle \[m\].
    pub across_m: f64,
    /// Distance along the street \[m\].
    pub along_m: f64,
    /// Heading, positive to the right of the street \[rad\].
    pub heading_rad: f64,
}

impl StreetPose {
    /// In the middle, looking along the street.
    pub fn along(along_m: f64) -> Self {
        Self { along_m, ..Self::default() }
    }
}

/// Smooth noise, 0 to 1, from a hash of whole numbers.
fn noise(u: f64, v: f64) -> f64 {
    let hash = |i: i64, j: i64| {
        let mut h = (i.wrapping_mul(0x9e37_79b9) ^ j.wrapping_mul(0x85eb_ca6b)) as u64;
        h = (h ^ (h >> 15)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        (h ^ (h >> 32)) as u32 as f64 / f64::from(u32::MAX)
    };
    let (i, j) = (u.floor(), v.floor());
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (ease(u - i), ease(v - j));
    let (i, j) = (i as i64, j as i64);
    let along = |j: i64| hash(i, j) * (1.0 - s) + hash(i + 1, j) * s;
    along(j) * (1.0 - t) + along(j + 1) * t
}

/// Two sizes of grain \[m\], so that near and far both show corners.
fn texture(u: f64, v: f64) -> f64 {
    0.5 * noise(u / 0.4, v / 0.4) + 0.5 * noise(u / 1.5 + 31.0, v / 1.5 + 17.0)
}

/// The ray through a pixel in the street (right, down, along), and the depth of its first surface \[m\].
fn ray(camera: &PinholeCamera, pose: &StreetPose, u: f64, v: f64) -> ([f64; 3], f64) {
    let (sin, cos) = pose.heading_rad.sin_cos();
    let (x, y) = ((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
    let (right, ahead) = (cos * x + sin, cos - sin * x);
    let to_wall = (TO_WALL_M - pose.across_m * right.signum()) / right.abs().max(1e-9);
    let to_road = if y > 1e-9 { HEIGHT_M / y } else { f64::INFINITY };
    ([right, y, ahead], to_wall.min(to_road).min(SIGHT_M))
}

/// Depth of the surface at a pixel \[m\].
pub fn depth(camera: &PinholeCamera, pose: &StreetPose, u: f64, v: f64) -> f64 {
    ray(camera, pose, u, v).1
}

/// Grey image of the street (0 to 255).
pub fn street_image(camera: &PinholeCamera, pose: &StreetPose) -> GrayImage {
    GrayImage::from_fn(camera.width, camera.height, |u, v| {
        let ([right, down, ahead], depth) = ray(camera, pose, f64::from(u), f64::from(v));
        let along = pose.along_m + depth * ahead;
        let value = if depth >= SIGHT_M {
            // The end of the street is too far to come nearer.
            noise((right / ahead) * 40.0, down * 40.0)
        } else if depth * down >= HEIGHT_M * (1.0 - 1e-12) {
            texture(pose.across_m + depth * right, along)
        } else {
            texture(depth * down + 40.0 * right.signum(), along)
        };
        Luma([(40.0 + 175.0 * value) as u8])
    })
}
