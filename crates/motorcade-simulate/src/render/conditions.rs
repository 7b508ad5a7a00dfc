//! Light that depends on the camera's place: lamps of the car, glare, a tunnel, a mirroring road.

use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::colour::Colour;
use super::resolve::Rays;
use super::surface_pixel::SurfacePixel;
use super::{low_sun, night, tunnel};
use crate::drive::Drive;
use crate::site::Site;
use crate::weather::Weather;

/// Picture without these conditions, row by row.
pub(super) struct Exposed<'a> {
    pub light: &'a mut [Colour],
    pub depth_m: &'a [f32],
    pub road: &'a [u8],
}

/// Changes the light of a picture that was taken from a pose, `way_m` after the start of the drive.
pub(super) fn apply(
    exposed: Exposed<'_>,
    drive: &Drive,
    camera: &PinholeCamera,
    pose: &Pose<Site, Camera>,
    way_m: f64,
) {
    let weather = drive.render.weather;
    if !matches!(weather, Weather::Night | Weather::LowSun | Weather::Tunnel) {
        return;
    }
    let forward = pose.transform_vector(&Vector3::z());
    let (right, down) = (pose.transform_vector(&Vector3::x()), pose.transform_vector(&Vector3::y()));
    let sun = drive.render.sun();
    let tunnel = tunnel::Tunnel::of(drive);
    let rays = Rays::of(camera, pose);
    let width = camera.width as usize;
    let Exposed { light, depth_m, road } = exposed;
    light.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, colour) in row.iter_mut().enumerate() {
            let at = y * width + x;
            let depth_m = depth_m.get(at).map_or(f64::INFINITY, |d| f64::from(*d));
            let road = road.get(at).map_or(0.0, |r| f32::from(*r) / 255.0);
            let seen = SurfacePixel { ray: rays.at(x as f64, y as f64).normalize(), depth_m, road };
            *colour = match weather {
                Weather::Night => {
                    night::seen(*colour, &seen, [right, down, forward].map(|a| a.dot(&seen.ray)))
                }
                Weather::LowSun => low_sun::seen(*colour, &seen, &sun),
                _ => tunnel.seen(*colour, &seen, way_m, way_m + depth_m),
            };
        }
    });
}
