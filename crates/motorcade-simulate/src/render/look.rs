//! Appearance of one vehicle with varied appearance: paint, glass, lamps, grille, plates, rims and fittings.

use motorcade_perception::VehicleClass;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::colour::Colour;
use crate::hash;

/// Lamps at one end; heights are relative to the corner above them, as fractions of the vehicle's height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamps {
    /// Inner edge, as a fraction of the width from the middle.
    pub inner: f32,
    /// Below and above the corner.
    pub low: f32,
    pub high: f32,
    /// Extent around the corner, as a fraction of the length.
    pub wrap: f32,
    /// Main colour, second colour and the share of the height the second takes, from below.
    pub lens: Colour,
    pub second: Colour,
    pub second_share: f32,
    /// Round reflectors inside.
    pub round: bool,
    /// Emitted light.
    pub lit: f32,
    /// Joined by a bar across.
    pub bar: bool,
    /// Height up the pillars beside the window, as a share of the glasshouse; 0 for lamps below it.
    pub climb: f32,
}

/// A number plate: middle height and half size as fractions of height and width.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plate {
    pub middle: f32,
    pub half_height: f32,
    pub half_width: f32,
    pub ground: Colour,
    pub shown: bool,
}

/// Air inlets of the front.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grille {
    pub half_width: f32,
    /// Below the corner of the bonnet.
    pub top: f32,
    pub height: f32,
    pub colour: Colour,
    /// Slats over its height; 0 for none.
    pub slats: f32,
    pub frame: Colour,
    pub lower_half_width: f32,
    pub lower_height: f32,
    pub badge: bool,
}

/// Appearance of one vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct VehicleLook {
    /// Shifts noise and reflections.
    pub shift: f32,
    pub paint: Colour,
    /// Reflectance of the clear coat at normal incidence.
    pub coat: f32,
    pub roof: Colour,
    /// Unpainted plastic below this height, as a fraction.
    pub cladding: f32,
    /// Bumpers of unpainted plastic.
    pub bare_bumpers: bool,
    pub plastic: Colour,
    pub glass: Colour,
    /// Reflectance of the glass at normal incidence.
    pub mirror: f32,
    /// Visibility of the interior, 0 to 1.
    pub through: f32,
    /// Darkness of the panes behind the driver.
    pub privacy: f32,
    /// Panes behind the driver are sheet metal.
    pub blind: bool,
    pub frame: Colour,
    pub pillar: f32,
    pub front: Lamps,
    pub rear: Lamps,
    pub grille: Grille,
    pub plates: [Plate; 2],
    /// Spokes, colour, share of the wheel's radius.
    pub spokes: f32,
    pub rim: Colour,
    pub rim_share: f32,
    pub moulding: f32,
    pub dirt: f32,
    /// A patch of another colour: lettering, stripes of a patrol car or taxi.
    pub patch: Option<([f32; 4], Colour)>,
    pub mirrors: bool,
    pub rails: bool,
    pub spoiler: bool,
    /// Third brake light: 0 for none, more for a lit one.
    pub brake_light: f32,
    pub rear_wiper: bool,
    /// Height of a sign on the roof, as a fraction of the height; 0 for none.
    pub sign: f32,
}

impl VehicleLook {
    pub(super) fn of(seed: u64, id: u32, class: VehicleClass) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(seed ^ 0x100c) ^ u64::from(id));
        let rng = &mut rng;
        let paint = paint(rng);
        let grey = |v: f32| [v, v, v * 1.02];
        let plastic = grey(rng.random_range(0.03..0.16));
        let van = class == VehicleClass::Van;
        Self {
            shift: rng.random_range(0.0..50.0),
            paint,
            coat: rng.random_range(0.02..0.12),
            roof: if rng.random_bool(0.1) { grey(rng.random_range(0.02..0.9)) } else { paint },
            cladding: if rng.random_bool(0.3) { rng.random_range(0.20..0.36) } else { 0.17 },
            bare_bumpers: rng.random_bool(if van { 0.6 } else { 0.12 }),
            plastic,
            glass: mixed_grey(rng, 0.015, 0.16),
            mirror: rng.random_range(0.05..0.45_f32).powf(1.3),
            through: if rng.random_bool(0.5) { rng.random_range(0.1..0.8) } else { 0.0 },
            privacy: if rng.random_bool(0.3) { rng.random_range(0.4..0.9) } else { 0.0 },
            blind: van && rng.random_bool(0.6),
            frame: match rng.random_range(0..4) {
                0 => paint,
                1 => grey(rng.random_range(0.4..0.8)),
                _ => grey(0.04),
            },
            pillar: rng.random_range(-0.36..-0.24),
            front: front_lamps(rng),
            rear: rear_lamps(rng),
            grille: grille(rng, paint, plastic),
            plates: [front_plate(rng), rear_plate(rng)],
            spokes: [0.0, 5.0, 5.0, 6.0, 7.0, 9.0, 10.0, 14.0][rng.random_range(0..8)],
            rim: grey(if rng.random_bool(0.2) {
                rng.random_range(0.03..0.15)
            } else {
                rng.random_range(0.3..0.85)
            }),
            rim_share: rng.random_range(0.58..0.76),
            moulding: if rng.random_bool(0.35) { rng.random_range(0.36..0.46) } else { 0.0 },
            dirt: if rng.random_bool(0.3) { rng.random_range(0.1..0.6) } else { 0.0 },
            patch: rng.random_bool(if van { 0.4 } else { 0.07 }).then(|| patch(rng)),
            mirrors: !rng.random_bool(0.05),
            rails: rng.random_bool(0.2),
            spoiler: rng.random_bool(0.3),
            brake_light: if rng.random_bool(0.7) { rng.random_range(0.1..1.4) } else { 0.0 },
            rear_wiper: rng.random_bool(0.5),
            sign: if rng.random_bool(0.04) { rng.random_range(0.05..0.11) } else { 0.0 },
        }
    }
}

fn mixed_grey(rng: &mut ChaCha8Rng, low: f32, high: f32) -> Colour {
    let v = rng.random_range(low..high);
    [v * rng.random_range(0.85..1.05), v, v * rng.random_range(0.95..1.2)]
}

/// Colours with the shares of cars sold: two thirds white, grey or black, the rest of any hue.
fn paint(rng: &mut ChaCha8Rng) -> Colour {
    let v: f32 = rng.random();
    if rng.random_bool(0.66) {
        let level = match rng.random_range(0..10) {
            0..4 => 0.02 + 0.10 * v,
            4..6 => 0.10 + 0.25 * v,
            6..8 => 0.35 + 0.3 * v,
            _ => 0.75 + 0.2 * v,
        };
        let tint = rng.random_range(-0.06..0.06);
        return [level * (1.0 - tint), level, level * (1.0 + tint)];
    }
    let hue: f32 = rng.random_range(0.0..6.0);
    // Red and blue are more common than the hues in between.
    let hue = if rng.random_bool(0.5) { [0.0, 0.1, 5.9, 3.6, 3.8, 3.4][hue as usize % 6] } else { hue };
    let (saturation, value) = (rng.random_range(0.25..0.92_f32), rng.random_range(0.06..0.75_f32));
    let channel = |offset: f32| {
        let k = (offset + hue) % 6.0;
        value * (1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0))
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

fn front_lamps(rng: &mut ChaCha8Rng) -> Lamps {
    let height = rng.random_range(0.06..0.16);
    let high = rng.random_range(-0.05..0.015);
    let v = rng.random_range(0.25..0.95);
    let lit = if rng.random_bool(0.25) { rng.random_range(0.4..1.6) } else { 0.0 };
    Lamps {
        inner: rng.random_range(0.20..0.36),
        low: high - height,
        high,
        wrap: rng.random_range(0.03..0.13),
        lens: [v, v, v * 1.03],
        second: if rng.random_bool(0.4) { [0.85, 0.45, 0.10] } else { [0.08, 0.08, 0.09] },
        second_share: if rng.random_bool(0.6) { rng.random_range(0.15..0.5) } else { 0.0 },
        round: rng.random_bool(0.6),
        lit,
        bar: false,
        climb: 0.0,
    }
}

fn rear_lamps(rng: &mut ChaCha8Rng) -> Lamps {
    let tall = rng.random_bool(0.35);
    let height = if tall { rng.random_range(0.18..0.38) } else { rng.random_range(0.08..0.18) };
    let high = if tall { rng.random_range(-0.02..0.10) } else { rng.random_range(-0.05..0.01) };
    let red = rng.random_range(0.25..0.75);
    let seconds = [[0.75, 0.74, 0.72], [0.85, 0.42, 0.08], [0.20, 0.02, 0.03], [0.10, 0.10, 0.11]];
    Lamps {
        inner: if tall { rng.random_range(0.36..0.43) } else { rng.random_range(0.22..0.38) },
        low: high - height,
        high,
        wrap: rng.random_range(0.015..0.08),
        lens: [red, rng.random_range(0.0..0.12) * red, rng.random_range(0.02..0.14) * red],
        second: seconds[rng.random_range(0..seconds.len())],
        second_share: if rng.random_bool(0.7) { rng.random_range(0.15..0.5) } else { 0.0 },
        round: rng.random_bool(0.3),
        lit: if rng.random_bool(0.3) { rng.random_range(0.3..1.5) } else { 0.0 },
        bar: rng.random_bool(0.12),
        climb: if rng.random_bool(0.25) { rng.random_range(0.3..1.0) } else { 0.0 },
    }
}

fn grille(rng: &mut ChaCha8Rng, paint: Colour, plastic: Colour) -> Grille {
    let closed = rng.random_bool(0.12);
    Grille {
        half_width: rng.random_range(0.10..0.30),
        top: rng.random_range(0.02..0.09),
        height: rng.random_range(0.03..0.20),
        colour: if closed { paint } else { plastic },
        slats: [0.0, 0.0, 2.0, 3.0, 4.0, 6.0][rng.random_range(0..6)],
        frame: if rng.random_bool(0.5) { [0.75, 0.76, 0.78] } else { plastic },
        lower_half_width: rng.random_range(0.15..0.42),
        lower_height: rng.random_range(0.03..0.10),
        badge: rng.random_bool(0.8),
    }
}

fn plate(rng: &mut ChaCha8Rng, middle: f32) -> Plate {
    let wide = rng.random_bool(0.8);
    let grounds = [[0.88, 0.88, 0.86], [0.88, 0.88, 0.86], [0.85, 0.70, 0.15], [0.55, 0.56, 0.58]];
    Plate {
        middle,
        half_height: if wide { rng.random_range(0.028..0.042) } else { rng.random_range(0.045..0.06) },
        half_width: if wide { rng.random_range(0.13..0.155) } else { rng.random_range(0.08..0.1) },
        ground: grounds[rng.random_range(0..grounds.len())],
        shown: rng.random_bool(0.92),
    }
}

fn front_plate(rng: &mut ChaCha8Rng) -> Plate {
    let middle = rng.random_range(0.20..0.36);
    plate(rng, middle)
}

fn rear_plate(rng: &mut ChaCha8Rng) -> Plate {
    let middle =
        if rng.random_bool(0.6) { rng.random_range(0.40..0.56) } else { rng.random_range(0.24..0.36) };
    plate(rng, middle)
}

fn patch(rng: &mut ChaCha8Rng) -> ([f32; 4], Colour) {
    let (x, z) = (rng.random_range(-0.45..0.1), rng.random_range(0.25..0.6));
    let (length, height) = (rng.random_range(0.1..0.6), rng.random_range(0.04..0.3));
    let colour = [rng.random_range(0.0..0.9), rng.random_range(0.0..0.9), rng.random_range(0.0..0.9)];
    ([x, x + length, z, z + height], colour)
}
