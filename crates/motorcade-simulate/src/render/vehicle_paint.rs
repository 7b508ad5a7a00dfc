//! What a vehicle's skin looks like where: paint, glass, lights, plate, wheel arches.

use motorcade_perception::VehicleClass;

use super::mesh::Part;
use super::shade::{Colour, Fragment, Scene, mixed, scaled};
use crate::vehicle::{AXLES, SimulatedVehicle};

/// Colour and how much of the sky it mirrors.
pub(super) struct Paint {
    pub colour: Colour,
    pub gloss: f32,
}

const GLASS: Colour = [0.10, 0.12, 0.14];
const TRIM: Colour = [0.07, 0.07, 0.08];

pub(super) fn colour(scene: &Scene<'_>, f: &Fragment, part: Part) -> Paint {
    let Some(vehicle) = usize::from(f.owner).checked_sub(1).and_then(|i| scene.drive.vehicles.get(i)) else {
        return Paint { colour: TRIM, gloss: 0.0 };
    };
    let p = f.attributes.map(|a| a as f32);
    let width: [f32; 3] = std::array::from_fn(|k| (f.dx[k].abs() + f.dy[k].abs()) as f32);
    let place = Place { p, width };
    let print = f.footprint(0, 2).scaled(4.0);
    let grain = scene.textures.noise.sample(4.0 * p[0] + vehicle.id as f32, 4.0 * p[2] + p[1], &print, 6.0);
    match part {
        Part::Tyre => Paint { colour: scaled([0.06, 0.06, 0.06], 1.0 + 0.4 * grain), gloss: 0.0 },
        Part::Hub => Paint { colour: scaled([0.48, 0.49, 0.50], 1.0 + 0.5 * grain), gloss: 0.1 },
        Part::Cargo => Paint { colour: scaled(cargo(&place), 1.0 + 0.1 * grain), gloss: 0.02 },
        Part::Cabin => cabin(vehicle, &place, grain),
        Part::Body => body(vehicle, &place, grain),
    }
}

/// A place on the unit vehicle and the pixel's extent there.
struct Place {
    p: [f32; 3],
    width: [f32; 3],
}

impl Place {
    /// Share of the pixel where coordinate `axis` lies in [low, high].
    fn within(&self, axis: usize, low: f32, high: f32) -> f32 {
        super::shade::cover(self.p[axis], low, high, self.width[axis])
    }
    /// The same for its absolute value.
    fn beside(&self, axis: usize, low: f32, high: f32) -> f32 {
        let low = if low > 0.0 { low } else { -high };
        super::shade::cover(self.p[axis].abs(), low, high, self.width[axis])
    }
}

/// Stripes and doors on a box.
fn cargo(place: &Place) -> Colour {
    let seam = place.within(1, -0.01, 0.01) * place.within(0, -1.0, -0.495);
    let stripe = place.within(2, 0.55, 0.70);
    mixed(mixed([0.78, 0.78, 0.76], [0.20, 0.30, 0.55], stripe), TRIM, seam.max(place.within(2, 0.0, 0.235)))
}

fn cabin(vehicle: &SimulatedVehicle, place: &Place, grain: f32) -> Paint {
    let shape = vehicle.shape as f32;
    let z = place.p[2];
    // Feet and roof edges of the glasshouse, as the mesh has them, at this height.
    let t = ((z - 0.615) / (0.93 - 0.615)).clamp(0.0, 1.0);
    let blend = |low: f32, high: f32| low + (high - low) * t;
    let rear = blend(-0.465 + 0.10 * shape, -0.372 + 0.13 * shape);
    let front = blend(0.245, 0.07);
    let half = blend(0.455, 0.372);
    let rows = place.within(2, 0.65, 0.925);
    // Side glass between the pillars, screens at both ends.
    let side = place.within(0, rear + 0.035, front - 0.03) * (1.0 - place.within(0, -0.085, -0.06));
    let on_side = ((place.p[1].abs() - half + 0.03) / 0.03).clamp(0.0, 1.0);
    let screen = place.beside(1, 0.0, half - 0.035);
    let glass = rows * (on_side * side + (1.0 - on_side) * screen).clamp(0.0, 1.0);
    let reflection = GLASS.map(|c| c * (1.0 + 0.9 * grain) + 0.05 * (z - 0.65));
    Paint { colour: mixed(vehicle.colour, reflection, glass), gloss: 0.06 + 0.22 * glass }
}

fn body(vehicle: &SimulatedVehicle, place: &Place, grain: f32) -> Paint {
    let class = vehicle.class;
    let [x, y, z] = place.p;
    let mut colour = scaled(vehicle.colour, 1.0 + 0.04 * grain);
    let mut gloss = 0.08;
    let size = vehicle.size;
    // Seams of the doors and the sill.
    let flank = place.beside(1, 0.44, 1.0);
    let seams = [-0.27, -0.07, 0.17].map(|at| place.within(0, at - 0.0025, at + 0.0025));
    colour =
        mixed(colour, TRIM, 0.7 * flank * seams.iter().sum::<f32>().min(1.0) * place.within(2, 0.16, 0.62));
    colour = mixed(colour, TRIM, 0.8 * place.within(2, 0.0, 0.19));
    let handle = flank
        * (place.within(0, -0.19, -0.155) + place.within(0, -0.055, -0.02))
        * place.within(2, 0.545, 0.56);
    colour = mixed(colour, TRIM, 0.6 * handle);
    // Wheel arches: dark round the wheels.
    let radius = if class == VehicleClass::Car { 0.255 } else { 0.19 };
    for axle in [AXLES.0, AXLES.1] {
        let (along, up) = ((x - axle as f32) * size.length_m as f32, (z - 0.21) * size.height_m as f32);
        let far = along.hypot(up);
        let reach = radius * size.height_m as f32;
        let soft = (place.width[0] * size.length_m as f32).max(0.01);
        colour = mixed(colour, TRIM, flank * ((reach - far) / soft + 0.5).clamp(0.0, 1.0));
    }
    let (low, high) = if class == VehicleClass::Car { (0.45, 0.57) } else { (0.30, 0.42) };
    if x < -0.42 {
        let lamp = place.within(0, -1.0, -0.44) * place.beside(1, 0.28, 0.47) * place.within(2, low, high);
        colour = mixed(colour, [0.62, 0.05, 0.05], lamp);
        let plate = place.within(0, -1.0, -0.45) * place.within(1, -0.145, 0.145);
        let rows = if class == VehicleClass::Car {
            place.within(2, 0.345, 0.42)
        } else {
            place.within(2, 0.22, 0.27)
        };
        colour = mixed(colour, [0.90, 0.89, 0.80], plate * rows);
        colour = mixed(colour, TRIM, place.within(0, -1.0, -0.45) * place.within(2, 0.20, 0.27) * 0.8);
    }
    if x > 0.40 {
        let lamp = place.within(0, 0.42, 1.0)
            * place.beside(1, 0.25, 0.45)
            * place.within(2, low - 0.07, high - 0.07);
        colour = mixed(colour, [0.88, 0.90, 0.93], lamp);
        let grille = place.within(0, 0.45, 1.0) * place.beside(1, 0.0, 0.22) * place.within(2, 0.30, 0.42);
        colour = mixed(colour, TRIM, grille);
        let plate = place.within(0, 0.46, 1.0) * place.within(1, -0.145, 0.145) * place.within(2, 0.23, 0.29);
        colour = mixed(colour, [0.90, 0.90, 0.86], plate);
    }
    // Windows of what has no separate cabin.
    let glass = match class {
        VehicleClass::Van => {
            let screen =
                place.within(0, 0.235, 0.345) * place.beside(1, 0.0, 0.43) * place.within(2, 0.58, 0.93);
            let side = flank * place.within(0, 0.02, 0.22) * place.within(2, 0.56, 0.84);
            let rear =
                place.within(0, -1.0, -0.47) * place.beside(1, 0.03, 0.40) * place.within(2, 0.58, 0.86);
            screen.max(side).max(rear)
        }
        VehicleClass::Truck => {
            let screen =
                place.within(0, 0.44, 1.0) * place.beside(1, 0.0, 0.43) * place.within(2, 0.55, 0.80);
            screen.max(flank * place.within(0, 0.36, 0.44) * place.within(2, 0.55, 0.78))
        }
        VehicleClass::Bus => {
            let panes = 1.0 - super::shade::cover_periodic(x, 0.0, 0.012, 0.13, place.width[0]);
            let side = flank * place.within(0, -0.46, 0.44) * place.within(2, 0.42, 0.80) * panes;
            let ends = place.beside(0, 0.465, 1.0) * place.beside(1, 0.0, 0.42) * place.within(2, 0.40, 0.86);
            side.max(ends)
        }
        VehicleClass::Car | VehicleClass::Motorcycle => 0.0,
    };
    colour = mixed(colour, scaled(GLASS, 1.0 + 0.9 * grain + 0.3 * y), glass);
    gloss += 0.18 * glass;
    Paint { colour, gloss }
}
