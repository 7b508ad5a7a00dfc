//! Shading: the colour of a surface at a pixel.

use nalgebra::{Point3, Vector3};

use super::air::Air;
use super::lighting::Lighting;
use super::look::VehicleLook;
use super::mesh::{Building, Material, Part};
use super::repairs::Repairs;
use super::shadow::Shadows;
use super::tile::{Footprint, Tile, floor};
use super::{facade, ground, varied_paint, vehicle_paint};
use crate::drive::Drive;
use crate::form::Form;

/// A colour, red, green, blue, 0 to 1.
pub(super) type Colour = [f32; 3];

/// Textures shared by all surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Textures {
    /// Grains and blotches of all sizes.
    pub noise: Tile,
    /// Thin dark lines.
    pub cracks: Tile,
    /// Soft and large.
    pub clouds: Tile,
}

impl Textures {
    pub(crate) fn new(seed: u64) -> Self {
        // Nearly the same amplitude at all scales, so that there is texture to track at every distance.
        let flat = |cells: usize| if cells < 8 { 0.4 } else { 1.0 };
        let noise = Tile::noise(seed, flat, |v| (1.3 * v).clamp(-1.0, 1.0));
        let line = |v: f32| -(1.0 - v.abs() * 22.0).clamp(0.0, 1.0);
        let cracks =
            Tile::noise(seed ^ 0x51, |cells| if cells <= 32 { 1.0 / cells as f32 } else { 0.0 }, line);
        let clouds = Tile::noise(seed ^ 0xc1, |cells| 1.0 / cells as f32, |v| (1.6 * v).clamp(-1.0, 1.0));
        Self { noise, cracks, clouds }
    }
}

/// Inputs of the shading of one frame.
pub(super) struct Scene<'a> {
    pub drive: &'a Drive,
    pub buildings: &'a [Building],
    pub textures: &'a Textures,
    pub repairs: &'a Repairs,
    /// One per vehicle.
    pub forms: &'a [Form],
    pub air: Air,
    pub shadows: Shadows,
    /// Towards the sun, in the site.
    pub sun: Vector3<f64>,
    /// Present with varied appearance.
    pub varied: Option<Varied<'a>>,
}

/// Further inputs with varied appearance.
pub(super) struct Varied<'a> {
    pub lighting: Lighting,
    /// One per vehicle.
    pub looks: &'a [VehicleLook],
    /// x, y, z of the vehicles in the site, one per vehicle.
    pub axes: Vec<[Vector3<f64>; 3]>,
}

/// Surface attributes at a pixel.
pub(super) struct Fragment {
    pub material: Material,
    pub attributes: [f64; 3],
    /// Change of the attributes to the next pixel right and down.
    pub dx: [f64; 3],
    pub dy: [f64; 3],
    /// In the site, towards the camera.
    pub normal: Vector3<f64>,
    pub point_in_site: Point3<f64>,
    pub depth_m: f64,
    /// From the camera to the point, unit, in the site.
    pub ray: Vector3<f64>,
    /// Vehicle index + 1, 0 for the world.
    pub owner: u16,
}

impl Fragment {
    /// The attributes, rounded.
    pub(super) fn place(&self) -> [f32; 3] {
        let [a, b, c] = self.attributes;
        [a as f32, b as f32, c as f32]
    }
    /// Footprint of the pixel in two of the attributes.
    pub(super) fn footprint(&self, i: usize, j: usize) -> Footprint {
        let (dx, dy) = (&self.dx, &self.dy);
        Footprint { dx: [dx[i] as f32, dx[j] as f32], dy: [dy[i] as f32, dy[j] as f32] }
    }
}

/// Colour and share of carriageway.
pub(super) struct Shaded {
    pub colour: Colour,
    pub road: f32,
}

pub(super) fn shade(scene: &Scene<'_>, f: &Fragment) -> Shaded {
    if let (Some(varied), Material::Skin(part)) = (&scene.varied, f.material) {
        return Shaded { colour: varied_skin(scene, varied, f, part), road: 0.0 };
    }
    let mut road = 0.0;
    let mut gloss = 0.0;
    let base = match f.material {
        Material::Ground => {
            let (colour, share) = ground::colour(scene, f);
            road = share;
            colour
        }
        Material::Facade(i) => {
            scene.buildings.get(i as usize).map_or(scene.air.haze, |b| facade::wall(scene.textures, b, f))
        }
        Material::Roof(i) => {
            scene.buildings.get(i as usize).map_or(scene.air.haze, |b| facade::roof(scene.textures, b, f))
        }
        Material::Post(colour) => {
            let print = f.footprint(0, 1).probe();
            let grain =
                scene.textures.noise.sample(f.attributes[0] as f32, f.attributes[1] as f32, &print, 2.3);
            scaled(colour, 1.0 + 0.25 * grain)
        }
        Material::Leaves(colour) => {
            let print = f.footprint(0, 1).probe();
            let (u, v) = (f.attributes[0] as f32, f.attributes[1] as f32);
            let grain = scene.textures.noise.sample(u, v, &print, 5.1);
            let clumps = scene.textures.noise.sample(v + 0.3, u, &print.swapped(), 23.0);
            scaled(colour, f.attributes[2] as f32 * (1.0 + 0.55 * grain + 0.3 * clumps))
        }
        Material::Skin(part) => {
            let paint = vehicle_paint::colour(scene, f, part);
            gloss = paint.gloss;
            paint.colour
        }
    };
    let air = &scene.air;
    let sun = f.normal.dot(&scene.sun).max(0.0) as f32;
    // Light of the sky from above, and a small reflection from the street.
    let sky = 0.5 + 0.5 * f.normal.z as f32;
    let clear = 1.0 - air.overcast;
    if let Some(varied) = &scene.varied {
        let open = scene.shadows.light_at(&f.point_in_site, &scene.sun, clear);
        let light = varied.lighting.on(scene.textures, &f.point_in_site, &f.normal, open);
        let mut colour = times(base, scaled(light.colour, air.brightness));
        if air.wet > 0.0 && f.material == Material::Ground && f.normal.z > 0.5 {
            colour = wet(scene, f, colour, road);
        }
        return Shaded { colour: hazy(air, colour, f.depth_m), road };
    }
    let shadow = if f.owner == 0 { scene.shadows.light_at(&f.point_in_site, &scene.sun, clear) } else { 1.0 };
    let light =
        (0.42 + 0.28 * sky) * (0.35 + 0.65 * shadow) + (0.45 * clear * sun + 0.18 * (1.0 - clear)) * shadow;
    let mut colour = scaled(base, light * air.brightness);
    if gloss > 0.0 {
        let mirror = scaled(air.haze, 0.25 + 0.75 * sky * sky);
        colour = mixed(colour, mirror, gloss);
    }
    if air.wet > 0.0 && f.material == Material::Ground && f.normal.z > 0.5 {
        colour = wet(scene, f, colour, road);
    }
    Shaded { colour: hazy(air, colour, f.depth_m), road }
}

/// A colour seen through a length of haze.
fn hazy(air: &Air, colour: Colour, depth_m: f64) -> Colour {
    let haze = 1.0 - (-(depth_m as f32) / air.reach_m).exp();
    mixed(colour, air.haze, haze)
}

/// A vehicle's surface under varied light: diffuse, reflected surroundings by Schlick's approximation, the sun's highlight.
fn varied_skin(scene: &Scene<'_>, varied: &Varied<'_>, f: &Fragment, part: Part) -> Colour {
    let index = usize::from(f.owner).wrapping_sub(1);
    let (Some(vehicle), Some(form), Some(look), Some([x, y, z])) = (
        scene.drive.vehicles.get(index),
        scene.forms.get(index),
        varied.looks.get(index),
        varied.axes.get(index),
    ) else {
        return scene.air.haze;
    };
    let air = &scene.air;
    let skin = varied_paint::skin(scene, f, part, (vehicle, form, look));
    let normal = (f.normal + x * skin.bulge.x + y * skin.bulge.y + z * skin.bulge.z).normalize();
    let light = varied.lighting.on(scene.textures, &f.point_in_site, &normal, 1.0);
    // Little light reaches the underside of the body.
    let height = f.attributes[2] as f32;
    let under = (0.25 + 2.5 * height).min(1.0) * if normal.z < -0.3 { 0.3 } else { 1.0 };
    let mut colour = times(skin.colour, scaled(light.colour, air.brightness * under));
    if skin.mirror > 0.0 {
        let away = f.ray;
        let facing = -away.dot(&normal);
        let reflected = away + normal * (2.0 * facing);
        let grazing = (1.0 - facing.clamp(0.0, 1.0) as f32).powi(5);
        let share = (skin.mirror + (1.0 - skin.mirror) * grazing * 0.7).clamp(0.0, 1.0) * under;
        let seen = varied.lighting.mirrored(scene.textures, air, &reflected, look.shift);
        colour = mixed(colour, scaled(seen, air.brightness), share);
        let glint = reflected.dot(&varied.lighting.sun).max(0.0) as f32;
        let highlight = glint.powi(90) * light.sun * 6.0 * share.min(0.3);
        colour = added(colour, scaled(varied.lighting.sun_colour, highlight));
    }
    hazy(air, added(colour, skin.glow), f.depth_m)
}

fn times(a: Colour, b: Colour) -> Colour {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

fn added(a: Colour, b: Colour) -> Colour {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Wet ground: darker, and reflecting the sky at grazing angles, more so in puddles.
fn wet(scene: &Scene<'_>, f: &Fragment, colour: Colour, road: f32) -> Colour {
    let (s, d) = (f.attributes[0] as f32, f.attributes[1] as f32);
    let pools = scene.textures.clouds.sample(s, d, &f.footprint(0, 1).probe(), 61.0);
    let dark = scaled(colour, 1.0 - scene.air.wet * (0.38 + 0.12 * pools));
    // Schlick's approximation for water; rough asphalt scatters most of the reflection.
    let to_eye = (1.0 / f.depth_m.max(1.0)) as f32 * 1.65;
    let grazing = (1.0 - to_eye.clamp(0.0, 1.0)).powi(5);
    let share = scene.air.wet * (0.02 + 0.98 * grazing) * (0.22 + 0.35 * pools).clamp(0.03, 0.6);
    mixed(dark, scaled(scene.air.haze, 1.05), share * (0.4 + 0.6 * road))
}

#[inline]
pub(super) fn scaled(colour: Colour, factor: f32) -> Colour {
    let [r, g, b] = colour;
    [r * factor, g * factor, b * factor]
}

/// Mix of a and b with a share of b.
#[inline]
pub(super) fn mixed(a: Colour, b: Colour, share: f32) -> Colour {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
}

/// Share of [low, high] in an interval of the given width about x.
#[inline]
pub(super) fn cover(x: f32, low: f32, high: f32, width: f32) -> f32 {
    let width = width.max(1e-4);
    let (a, b) = ((x - 0.5 * width).max(low), (x + 0.5 * width).min(high));
    ((b - a) / width).clamp(0.0, 1.0)
}

/// The same for [low, high] repeated every `period`, all within one period; exact for any width.
#[inline]
pub(super) fn cover_periodic(x: f32, low: f32, high: f32, period: f32, width: f32) -> f32 {
    let width = width.max(1e-4);
    let rate = 1.0 / period;
    // Integral from 0 of the indicator of the stripes.
    let integral = |x: f32| {
        let whole = floor(x * rate);
        whole * (high - low) + (x - whole * period - low).clamp(0.0, high - low)
    };
    let x = x - period * floor(x * rate);
    ((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covers_are_exact_shares() {
        assert_eq!(cover(0.0, 0.0, 9.0, 1.0), 0.5);
        assert!((cover_periodic(7.3, 0.25, 0.5, 1.0, 100.0) - 0.25).abs() < 1e-3);
        assert!((cover_periodic(7.4, 0.25, 0.5, 1.0, 0.01) - 1.0).abs() < 1e-3);
        assert!(cover_periodic(-0.1, 0.25, 0.5, 1.0, 0.01) < 1e-3);
    }
}
