//! Light of a scene with varied appearance: sun, sky, shade of trees, and reflections in paint and glass.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::air::Air;
use super::colour::{Colour, mixed, scaled};
use super::textures::Textures;
use super::tile::Probe;
use crate::hash;

/// Directions and strengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lighting {
    /// Towards the sun, in the site.
    pub sun: Vector3<f64>,
    pub sun_colour: Colour,
    pub sky_colour: Colour,
    /// Irradiance from below.
    pub bounce: f32,
    /// Share of the ground shaded by objects outside the scene.
    shaded: f32,
    /// Darkness of that shade, 0 to 1.
    shade_depth: f32,
    /// Size of the patches of shade \[m\].
    patch_m: f32,
    /// Elevation of the surroundings, as tangent, and their colour.
    skyline: f32,
    skyline_colour: Colour,
    ground_colour: Colour,
}

impl Lighting {
    pub(super) fn of(seed: u64, air: &Air) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(seed ^ 0x119f7));
        let azimuth = rng.random_range(0.0..std::f64::consts::TAU);
        let height: f64 = rng.random_range(0.25..1.3);
        let sun = Vector3::new(azimuth.cos(), azimuth.sin(), height).normalize();
        let clear = 1.0 - air.overcast;
        let sun_strength = clear * rng.random_range(0.4..1.4_f32);
        let warm = rng.random_range(0.0..0.16_f32);
        let sky = rng.random_range(0.22..0.62_f32) + 0.35 * air.overcast;
        let blue = rng.random_range(-0.03..0.14_f32) * clear;
        let tree = rng.random_bool(0.6);
        let dark = rng.random_range(0.05..0.30_f32);
        Self {
            sun,
            sun_colour: [sun_strength * (1.0 + warm), sun_strength, sun_strength * (1.0 - warm)],
            sky_colour: [sky * (1.0 - blue), sky, sky * (1.0 + blue)],
            bounce: rng.random_range(0.05..0.35),
            shaded: if rng.random_bool(0.6) { rng.random_range(0.1..0.7) } else { 0.0 },
            shade_depth: rng.random_range(0.4..0.92),
            patch_m: rng.random_range(5.0..40.0),
            skyline: rng.random_range(0.02..0.7),
            skyline_colour: if tree {
                [0.7 * dark, dark, 0.5 * dark]
            } else {
                [1.3 * dark, 1.2 * dark, dark]
            },
            ground_colour: scaled([0.33, 0.33, 0.34], rng.random_range(0.5..1.3)),
        }
    }

    /// Share of the sun's and the sky's light that reaches a point past objects outside the scene.
    fn shade_at(&self, textures: &Textures, point: &nalgebra::Point3<f64>) -> f32 {
        if self.shaded <= 0.0 {
            return 1.0;
        }
        // Along the sun's rays down to the ground.
        let down = point.z / self.sun.z.max(0.2);
        let (u, v) = ((point.x - down * self.sun.x) as f32, (point.y - down * self.sun.y) as f32);
        let scale = 1.0 / self.patch_m;
        let soft = textures.clouds.sample(u * scale, v * scale, &Probe::square(0.05 * scale), 4.3);
        let leaves = textures.noise.sample(u, v, &Probe::square(0.2), 7.9);
        let level = soft + 0.25 * leaves - (1.0 - 2.0 * self.shaded) * 0.5;
        1.0 - self.shade_depth * (3.0 * level + 0.5).clamp(0.0, 1.0)
    }

    /// Light on a surface; `open` is the share that vehicles do not block.
    pub(super) fn on(
        &self,
        textures: &Textures,
        point: &nalgebra::Point3<f64>,
        normal: &Vector3<f64>,
        open: f32,
    ) -> Light {
        let shade = self.shade_at(textures, point);
        let sun = normal.dot(&self.sun).max(0.0) as f32 * open * shade;
        let up = 0.5 + 0.5 * normal.z as f32;
        // Objects that shade the sun block a part of the sky, too.
        let sky = up * (0.35 + 0.65 * open) * (0.55 + 0.45 * shade)
            + self.bounce * (1.0 - up) * (0.4 + 0.6 * shade);
        let colour = std::array::from_fn(|k| self.sky_colour[k] * sky + self.sun_colour[k] * sun);
        Light { colour, sun: open * shade }
    }

    /// Radiance of the surroundings in a direction (unit vector, site).
    pub(super) fn mirrored(
        &self,
        textures: &Textures,
        air: &Air,
        direction: &Vector3<f64>,
        shift: f32,
    ) -> Colour {
        let (x, y, z) = (direction.x as f32, direction.y as f32, direction.z as f32);
        let round = y.atan2(x) / std::f32::consts::TAU;
        let ridge = textures.clouds.sample(round * 40.0 + shift, 3.1, &Probe::square(0.3), 23.0);
        let steps = textures.noise.sample(round * 30.0 + shift, 9.2, &Probe::square(0.5), 11.0);
        let crest = self.skyline * (0.55 + 0.6 * ridge + 0.35 * steps).max(0.02);
        let level = z / (1.0 - z * z).max(1e-3).sqrt();
        let above = ((level - crest) / 0.10 + 0.5).clamp(0.0, 1.0);
        let below = ((-level) / 0.05 + 0.5).clamp(0.0, 1.0);
        let blue = mixed([0.30, 0.45, 0.72], [0.62, 0.65, 0.68], air.overcast);
        let sky = scaled(mixed(air.haze, blue, (1.4 * z).clamp(0.0, 1.0)), 1.15);
        let clutter = 1.0 + 0.8 * textures.noise.sample(round * 60.0, level * 6.0, &Probe::square(0.2), 5.0);
        let land = scaled(self.skyline_colour, clutter);
        let ground = scaled(self.ground_colour, (1.0 + 1.2 * z).clamp(0.25, 1.0));
        mixed(mixed(land, sky, above), ground, below)
    }
}

/// Light at a point.
pub(super) struct Light {
    pub colour: Colour,
    /// Share of the sun that is not hidden.
    pub sun: f32,
}
