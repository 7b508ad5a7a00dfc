//! Sky, clouds and the far horizon.

use nalgebra::Vector3;

use super::air::Air;
use super::colour::{Colour, mixed, scaled};
use super::textures::Textures;
use super::tile::Probe;

/// Colour in a direction (unit vector, site); `pixel_rad` is the angle of a pixel.
pub(super) fn colour(textures: &Textures, air: &Air, direction: &Vector3<f64>, pixel_rad: f64) -> Colour {
    let (x, y, z) = (direction.x as f32, direction.y as f32, direction.z as f32);
    let angle = pixel_rad as f32;
    // Hills all around, a few degrees high, closed over the full turn; none higher up.
    let low = z < 0.028 + angle;
    let round = if low { y.atan2(x) / std::f32::consts::TAU } else { 0.0 };
    let print = |scale: f32| Probe::square(angle * scale);
    let mut hill = 0.0;
    if low {
        let ridge = textures.clouds.sample(round * 64.0, 7.3, &print(10.0), 64.0);
        let crest = 0.016 + 0.012 * ridge;
        hill = ((crest - z) / angle + 0.5).clamp(0.0, 1.0);
    }
    let mut sky = air.haze;
    if hill < 1.0 {
        let up = z.max(0.02);
        let blue = mixed([0.36, 0.53, 0.78], [0.60, 0.64, 0.68].map(|c| c * air.brightness), air.overcast);
        sky = mixed(air.haze, blue, (1.6 * up).min(1.0));
        // Clouds on a plane at a height of one kilometre.
        let reach = 1.0 / up;
        let along = angle * reach * reach;
        let cloud = textures.clouds.sample(x * reach, y * reach, &Probe::square(along), 4.3);
        let fade = ((z - 0.02) / 0.10).clamp(0.0, 1.0);
        let share = (0.25 + 0.4 * air.overcast + 1.1 * cloud).clamp(0.0, 1.0) * fade;
        sky = mixed(sky, air.cloud, share * 0.85);
    }
    if hill <= 0.0 {
        return sky;
    }
    let trees = textures.noise.sample(round * 640.0, z * 100.0, &print(100.0), 64.0);
    let land = mixed(scaled([0.33, 0.41, 0.36], air.brightness * (1.0 + 0.35 * trees)), air.haze, 0.35);
    mixed(sky, land, hill)
}
