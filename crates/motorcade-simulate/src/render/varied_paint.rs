//! Surface of vehicles with varied appearance: paint with a clear coat, reflecting panes, lamps, grilles, plates, rims.

use nalgebra::Vector3;

use super::colour::{Colour, mixed, scaled};
use super::coverage::{cover, cover_periodic};
use super::look::{Lamps, Plate, VehicleLook};
use super::scene::{Fragment, Scene};
use crate::form::{Form, Glasshouse};
use crate::hash;
use crate::mesh::Part;
use crate::vehicle::SimulatedVehicle;

/// Optical properties of a surface point.
pub(super) struct Skin {
    /// Diffuse colour.
    pub colour: Colour,
    /// Reflectance at normal incidence; 0 for matt surfaces.
    pub mirror: f32,
    /// Emitted light.
    pub glow: Colour,
    /// Smoothed normal (vehicle frame, not unit), as an offset to the facet's.
    pub bulge: Vector3<f64>,
}

const DARK: Colour = [0.02, 0.02, 0.022];

/// A point on the unit vehicle and the pixel's extent there.
struct SurfacePoint {
    p: [f32; 3],
    width: [f32; 3],
}

impl SurfacePoint {
    fn within(&self, axis: usize, low: f32, high: f32) -> f32 {
        cover(self.p[axis], low, high, self.width[axis])
    }
    /// The same for its absolute value.
    fn beside(&self, axis: usize, low: f32, high: f32) -> f32 {
        let low = if low > 0.0 { low } else { -high };
        cover(self.p[axis].abs(), low, high, self.width[axis])
    }
}

pub(super) fn skin(
    scene: &Scene<'_>,
    f: &Fragment,
    part: Part,
    (vehicle, form, look): (&SimulatedVehicle, &Form, &VehicleLook),
) -> Skin {
    let p = f.place();
    let wide = |k: usize| (f.dx[k].abs() + f.dy[k].abs()) as f32;
    let place = SurfacePoint { p, width: [wide(0), wide(1), wide(2)] };
    let print = f.footprint(0, 2).probe().scaled(4.0);
    let grain = scene.textures.noise.sample(4.0 * p[0] + look.shift, 4.0 * p[2] + p[1], &print, 6.0);
    let [x, y, z] = p.map(f64::from);
    let bulge = Vector3::new(0.35 * x, 0.55 * y, 0.5 * (z - 0.5).clamp(-0.35, 0.35));
    let matt = |colour: Colour| Skin { colour, mirror: 0.0, glow: [0.0; 3], bulge: Vector3::zeros() };
    match part {
        Part::Tyre => matt(scaled([0.035, 0.035, 0.036], 1.0 + 0.5 * grain)),
        Part::Hub => matt(hub(&place, form, vehicle, look, grain)),
        Part::Cargo => matt(mixed(look.paint, [0.75, 0.75, 0.73], 0.5)),
        Part::Trim => Skin { colour: look.plastic, mirror: 0.03, glow: [0.0; 3], bulge },
        Part::Cabin => match &form.glasshouse {
            Some(g) => Skin { bulge, ..cabin(vehicle, g, look, &place, grain) },
            None => matt(look.paint),
        },
        Part::Body => Skin { bulge, ..body(vehicle, form, look, &place, grain) },
    }
}

fn hub(
    place: &SurfacePoint,
    form: &Form,
    vehicle: &SimulatedVehicle,
    look: &VehicleLook,
    grain: f32,
) -> Colour {
    let [x, _, z] = place.p;
    let nearer = |a: f64| (x - a as f32).abs();
    let axle =
        if nearer(form.front_axle) < nearer(form.rear_axle) { form.front_axle } else { form.rear_axle };
    let size = &vehicle.size;
    let (along, up) =
        ((x - axle as f32) * size.length_m as f32, (z - form.tyre_radius as f32) * size.height_m as f32);
    let radius = form.tyre_radius as f32 * size.height_m as f32;
    let far = along.hypot(up) / radius.max(0.1);
    let pixel = (place.width[0] * size.length_m as f32 / radius.max(0.1)).max(0.01);
    let rim = ((look.rim_share - far) / pixel + 0.5).clamp(0.0, 1.0);
    let mut colour = scaled(look.rim, 1.0 + 0.3 * grain);
    if look.spokes > 0.0 {
        let turn = up.atan2(along) / std::f32::consts::TAU + 0.013 * look.shift;
        let wide = (pixel / (6.3 * far.max(0.05))).min(1.0);
        let gaps = cover_periodic(turn, 0.0, 0.55 / look.spokes, 1.0 / look.spokes, wide);
        let between = cover(far, 0.2, look.rim_share - 0.07, pixel);
        colour = mixed(colour, DARK, 0.9 * gaps * between);
    }
    mixed([0.035, 0.035, 0.036], colour, rim)
}

fn cabin(
    vehicle: &SimulatedVehicle,
    g: &Glasshouse,
    look: &VehicleLook,
    place: &SurfacePoint,
    grain: f32,
) -> Skin {
    let [x, y, z] = place.p;
    let between = |(x, foot): (f64, f64), roof: f64| {
        let t = ((z - foot as f32) / (g.roof_corner - foot) as f32).clamp(0.0, 1.0);
        (x + (roof - x) * f64::from(t)) as f32
    };
    let (rear, front) = (between(g.rear_window, g.roof_rear), between(g.windscreen, g.roof_front));
    let belt = g.windscreen.1.max(g.rear_window.1) as f32;
    let roof_half = vehicle.roof_half() as f32;
    let t = ((z - belt) / (g.roof_corner as f32 - belt)).clamp(0.0, 1.0);
    let half = 0.437 + (roof_half - 0.437) * t;
    let rows = place.within(2, belt + 0.015, g.roof_corner as f32 - 0.014);
    let screen_rows = place.within(2, belt - 0.03, g.roof_corner as f32 - 0.005);
    let pillar = front + look.pillar;
    let mut side =
        place.within(0, rear + 0.035, front - 0.03) * (1.0 - place.within(0, pillar, pillar + 0.022));
    if look.blind {
        side *= place.within(0, pillar, 1.0);
    }
    let on_side = ((y.abs() - half + 0.03) / 0.03).clamp(0.0, 1.0);
    let ends = place.beside(1, 0.0, half - 0.03);
    let screen = if look.blind && x < 0.0 { 0.0 } else { ends };
    let glass = (rows * on_side * side + screen_rows * (1.0 - on_side) * screen).clamp(0.0, 1.0);
    let surround = place.within(2, belt - 0.005, g.roof_corner as f32 + 0.004)
        * on_side
        * place.within(0, rear + 0.02, front - 0.015);
    let is_roof = ((z - g.roof_corner as f32) / 0.02).clamp(0.0, 1.0);
    let outer = mixed(mixed(look.paint, look.roof, is_roof), look.frame, 0.9 * surround * (1.0 - is_roof));
    // Seats and head rests behind the glass, lighter sky through the panes opposite.
    let inside = (look.through
        * (0.35 + 0.65 * (grain * 2.0 + 0.3 * (9.0 * y).sin()).clamp(0.0, 1.0))
        * ((z - belt) * 6.0).clamp(0.0, 1.0))
    .clamp(0.0, 1.0);
    let dim = if x < pillar && on_side > 0.5 { 1.0 - look.privacy } else { 1.0 };
    let pane = mixed(look.glass, [0.34, 0.36, 0.36], inside * 0.8 * dim);
    let mirror = look.coat + (look.mirror - look.coat) * glass;
    let colour = mixed(outer, scaled(pane, dim), glass);
    let mut skin = Skin { colour, mirror, glow: [0.0; 3], bulge: Vector3::zeros() };
    if x < rear + 0.06 {
        tailgate(&mut skin, look, place, (belt, g.roof_corner as f32, half));
    }
    skin
}

/// Parts of a tailgate above the belt line: lamps on its pillars, a third brake light, a wiper.
fn tailgate(skin: &mut Skin, look: &VehicleLook, place: &SurfacePoint, (belt, roof, half): (f32, f32, f32)) {
    let lamps = &look.rear;
    if lamps.climb > 0.0 {
        let top = belt + lamps.climb * (roof - belt);
        let lens = place.beside(1, half - 0.055, 1.0) * place.within(2, belt - 0.05, top);
        skin.colour = mixed(skin.colour, lamps.lens, lens);
        skin.mirror += (0.08 - skin.mirror) * lens;
        if lamps.lit > 0.0 {
            skin.glow = scaled([1.0, 0.10, 0.08], 0.6 * lamps.lit * lens);
        }
    }
    if look.brake_light > 0.0 {
        let strip = place.within(1, -0.09, 0.09) * place.within(2, roof - 0.012, roof + 0.012);
        skin.colour = mixed(skin.colour, [0.45, 0.04, 0.04], strip);
        let lit = (look.brake_light - 0.7).max(0.0) * strip;
        skin.glow = scaled([1.0, 0.15, 0.10], lit);
    }
    if look.rear_wiper {
        let low = belt + 0.03;
        let blade = place.within(1, -0.02, 0.26) * place.within(2, low, low + 0.012);
        skin.colour = mixed(skin.colour, DARK, 0.8 * blade);
    }
}

fn body(
    vehicle: &SimulatedVehicle,
    form: &Form,
    look: &VehicleLook,
    place: &SurfacePoint,
    grain: f32,
) -> Skin {
    let [x, _, z] = place.p;
    let size = vehicle.size;
    let g = form.glasshouse.as_ref();
    let mut colour = scaled(look.paint, 1.0 + 0.05 * grain);
    let mut mirror = look.coat;
    let flank = place.beside(1, 0.44, 1.0);
    let front = g.map_or(0.17, |g| g.windscreen.0 as f32 - 0.03);
    if let Some(([x0, x1, z0, z1], patch)) = look.patch {
        let within = place.within(0, x0, x1) * place.within(2, z0, z1);
        colour = mixed(colour, patch, flank * within);
    }
    if look.bare_bumpers {
        let ends = place.beside(0, 0.455, 1.0) * place.within(2, 0.0, 0.40);
        colour = mixed(colour, look.plastic, ends);
        mirror *= 1.0 - 0.8 * ends;
    }
    let plastic = place.within(2, 0.0, look.cladding);
    colour = mixed(colour, look.plastic, 0.9 * plastic);
    mirror *= 1.0 - 0.8 * plastic;
    let doors = [front - 0.46, front - 0.235, front].map(|at| place.within(0, at - 0.002, at + 0.002));
    let seams = doors.iter().sum::<f32>().min(1.0) * place.within(2, 0.16, 0.64);
    let moulding =
        if look.moulding > 0.0 { place.within(2, look.moulding, look.moulding + 0.03) } else { 0.0 };
    colour = mixed(colour, DARK, flank * (0.7 * seams + 0.6 * moulding).min(1.0));
    let handle = (place.within(0, front - 0.44, front - 0.405)
        + place.within(0, front - 0.215, front - 0.18))
        * place.within(2, 0.55, 0.57);
    colour = mixed(colour, mixed(look.frame, DARK, 0.3), 0.6 * flank * handle);
    let radius = (form.tyre_radius * size.height_m) as f32;
    for axle in [form.front_axle, form.rear_axle] {
        let (along, up) = ((x - axle as f32) * size.length_m as f32, z * size.height_m as f32 - radius);
        let soft = (place.width[0] * size.length_m as f32).max(0.01);
        let arch = flank * ((radius + 0.07 - along.hypot(up)) / soft + 0.5).clamp(0.0, 1.0);
        colour = mixed(colour, DARK, arch);
        mirror *= 1.0 - arch;
    }
    let mut skin = Skin { colour, mirror, glow: [0.0; 3], bulge: Vector3::zeros() };
    if x < -0.38 {
        rear(&mut skin, g, look, place);
    }
    if x > 0.34 {
        nose(&mut skin, g, look, place);
    }
    // Road dirt from below.
    let dirt = look.dirt * (0.6 + 0.4 * grain) * (1.0 - z / 0.5).clamp(0.0, 1.0);
    skin.colour = mixed(skin.colour, [0.30, 0.27, 0.23], dirt);
    skin.mirror *= 1.0 - dirt;
    skin
}

fn rear(skin: &mut Skin, g: Option<&Glasshouse>, look: &VehicleLook, place: &SurfacePoint) {
    let corner = g.map_or(0.42, |g| g.tail as f32);
    let back = place.within(0, -1.0, -0.45);
    let lid = place.within(0, -1.0, -0.47) * place.within(1, -0.33, 0.33) * place.within(2, 0.335, 0.345);
    skin.colour = mixed(skin.colour, DARK, 0.6 * lid);
    lamps(skin, &look.rear, place, corner, -1.0);
    skin.colour = mixed(skin.colour, look.plastic, back * place.within(2, 0.19, 0.25) * 0.8);
    plate(skin, &look.plates[1], look.shift, place, back);
    if look.grille.badge {
        badge(skin, place, corner - 0.06, back);
    }
}

fn nose(skin: &mut Skin, g: Option<&Glasshouse>, look: &VehicleLook, place: &SurfacePoint) {
    let corner = g.map_or(0.42, |g| g.bonnet as f32);
    let end = place.within(0, 0.455, 1.0);
    let grille = &look.grille;
    let (top, bottom) = (corner - grille.top, corner - grille.top - grille.height);
    let area = end * place.beside(1, 0.0, grille.half_width) * place.within(2, bottom, top);
    let framed =
        end * place.beside(1, 0.0, grille.half_width + 0.012) * place.within(2, bottom - 0.012, top + 0.012);
    skin.colour = mixed(skin.colour, grille.frame, (framed - area).max(0.0));
    let mut inner = grille.colour;
    if grille.slats > 0.0 {
        let pitch = grille.height / grille.slats;
        let slat = cover_periodic(place.p[2] - bottom, 0.0, 0.4 * pitch, pitch, place.width[2]);
        inner = mixed(inner, grille.frame, 0.7 * slat);
    }
    skin.colour = mixed(skin.colour, inner, area);
    let low = end
        * place.beside(1, 0.0, grille.lower_half_width)
        * place.within(2, 0.15, 0.15 + grille.lower_height);
    skin.colour = mixed(skin.colour, DARK, 0.9 * low);
    skin.mirror *= 1.0 - 0.8 * area.max(low);
    if grille.badge {
        badge(skin, place, top - 0.4 * grille.height, end);
    }
    lamps(skin, &look.front, place, corner, 1.0);
    plate(skin, &look.plates[0], look.shift, place, end);
}

fn badge(skin: &mut Skin, place: &SurfacePoint, middle: f32, end: f32) {
    let mark = place.beside(1, 0.0, 0.025) * place.within(2, middle - 0.022, middle + 0.022);
    skin.colour = mixed(skin.colour, [0.72, 0.73, 0.75], 0.8 * end * mark);
}

/// `end` is +1 at the nose, −1 at the tail.
fn lamps(skin: &mut Skin, lamps: &Lamps, place: &SurfacePoint, corner: f32, end: f32) {
    let (low, high) = (corner + lamps.low, corner + lamps.high);
    let from = 0.5 - lamps.wrap;
    let x = if end > 0.0 { place.within(0, from, 1.0) } else { place.within(0, -1.0, -from) };
    let mut within = x * place.beside(1, lamps.inner, 1.0) * place.within(2, low, high);
    if lamps.bar {
        within = within.max(x * place.within(2, 0.5 * (low + high), high));
    }
    if within <= 0.0 {
        return;
    }
    let share = ((place.p[2] - low) / (high - low)).clamp(0.0, 1.0);
    let second =
        ((lamps.second_share - share) / 0.08 + 0.5).clamp(0.0, 1.0) * lamps.second_share.min(1.0).signum();
    let mut lens = mixed(lamps.lens, lamps.second, if lamps.second_share > 0.0 { second } else { 0.0 });
    let centre = 0.5 * (lamps.inner + 0.47);
    let off = (place.p[1].abs() - centre).hypot((place.p[2] - 0.5 * (low + high)) * 0.8);
    let reflector = (((0.42 * (high - low)) - off) / place.width[1].max(0.01) + 0.5).clamp(0.0, 1.0);
    if lamps.round {
        // The housing round a reflector is darker.
        lens = mixed(scaled(lens, 0.45), scaled(lens, 1.25), reflector);
    }
    skin.colour = mixed(skin.colour, lens, within);
    skin.mirror += (0.10 - skin.mirror) * within;
    if lamps.lit > 0.0 {
        let strength = lamps.lit * within * (0.3 + 0.7 * reflector);
        skin.glow = scaled(if end > 0.0 { [1.0, 0.98, 0.92] } else { [1.0, 0.10, 0.08] }, strength);
    }
}

fn plate(skin: &mut Skin, plate: &Plate, shift: f32, place: &SurfacePoint, end: f32) {
    if !plate.shown {
        return;
    }
    let (low, high) = (plate.middle - plate.half_height, plate.middle + plate.half_height);
    let area = end * place.within(1, -plate.half_width, plate.half_width) * place.within(2, low, high);
    if area <= 0.0 {
        return;
    }
    // Glyphs: dark bars of different widths, faded out where a pixel is as wide as they are.
    let cell = (place.p[1] / 0.022).floor();
    let near = (1.0 - place.width[1] / 0.03).clamp(0.0, 1.0);
    let dark = hash::unit(shift.to_bits().into(), cell as i64, 1) < 0.55;
    let rows = place.within(2, low + 0.25 * plate.half_height, high - 0.25 * plate.half_height);
    let ink = rows * if dark { 0.75 * near + 0.35 * (1.0 - near) } else { 0.35 * (1.0 - near) };
    let surface = mixed(plate.ground, [0.05, 0.05, 0.06], ink);
    skin.colour = mixed(skin.colour, surface, area);
    skin.mirror *= 1.0 - area;
}
