//! Shading: the colour of a surface at a pixel.

use super::air::Air;
use super::colour::{Colour, added, mixed, scaled, times};
use super::scene::{Fragment, Scene, Varied};
use super::{facade, ground, varied_paint, vehicle_paint};
use crate::mesh::{Material, Part};

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
