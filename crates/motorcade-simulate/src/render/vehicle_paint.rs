//! Colours of a vehicle's surface: paint, glass, lights, plate, wheel arches.

use motorcade_perception::VehicleClass;

use super::colour::{Colour, mixed, scaled};
use super::scene::{Fragment, Scene};
use crate::form::{Form, Glasshouse};
use crate::mesh::Part;
use crate::vehicle::{Body, SimulatedVehicle};

/// Colour and reflectance.
pub(super) struct Paint {
    pub colour: Colour,
    pub gloss: f32,
}

const GLASS: Colour = [0.10, 0.12, 0.14];
const TRIM: Colour = [0.07, 0.07, 0.08];

pub(super) fn colour(scene: &Scene<'_>, f: &Fragment, part: Part) -> Paint {
    let index = usize::from(f.owner).checked_sub(1);
    let Some((vehicle, form)) = index.and_then(|i| Some((scene.drive.vehicles.get(i)?, scene.forms.get(i)?)))
    else {
        return Paint { colour: TRIM, gloss: 0.0 };
    };
    let p = f.place();
    let wide = |k: usize| (f.dx[k].abs() + f.dy[k].abs()) as f32;
    let width = [wide(0), wide(1), wide(2)];
    let place = SurfacePoint { p, width };
    let print = f.footprint(0, 2).probe().scaled(4.0);
    let grain = scene.textures.noise.sample(4.0 * p[0] + vehicle.id as f32, 4.0 * p[2] + p[1], &print, 6.0);
    match part {
        Part::Tyre => Paint { colour: scaled([0.06, 0.06, 0.06], 1.0 + 0.4 * grain), gloss: 0.0 },
        Part::Hub => Paint { colour: scaled([0.48, 0.49, 0.50], 1.0 + 0.5 * grain), gloss: 0.1 },
        Part::Trim => Paint { colour: TRIM, gloss: 0.0 },
        Part::Cargo => Paint { colour: scaled(cargo(&place), 1.0 + 0.1 * grain), gloss: 0.02 },
        Part::Cabin => cabin(vehicle, form.glasshouse.as_ref(), &place, grain),
        Part::Body => body(vehicle, form, &place, grain),
    }
}

/// A point on the unit vehicle and the pixel's extent there.
struct SurfacePoint {
    p: [f32; 3],
    width: [f32; 3],
}

impl SurfacePoint {
    /// Share of the pixel where coordinate `axis` lies in [low, high].
    fn within(&self, axis: usize, low: f32, high: f32) -> f32 {
        super::coverage::cover(self.p[axis], low, high, self.width[axis])
    }
    /// The same for its absolute value.
    fn beside(&self, axis: usize, low: f32, high: f32) -> f32 {
        let low = if low > 0.0 { low } else { -high };
        super::coverage::cover(self.p[axis].abs(), low, high, self.width[axis])
    }
}

/// Stripes and doors on a box.
fn cargo(place: &SurfacePoint) -> Colour {
    let seam = place.within(1, -0.01, 0.01) * place.within(0, -1.0, -0.495);
    let stripe = place.within(2, 0.55, 0.70);
    mixed(mixed([0.78, 0.78, 0.76], [0.20, 0.30, 0.55], stripe), TRIM, seam.max(place.within(2, 0.0, 0.235)))
}

fn cabin(
    vehicle: &SimulatedVehicle,
    glasshouse: Option<&Glasshouse>,
    place: &SurfacePoint,
    grain: f32,
) -> Paint {
    let Some(g) = glasshouse else { return Paint { colour: vehicle.colour, gloss: 0.06 } };
    let z = place.p[2];
    // Ends and half width of the glasshouse, as the mesh has them, at this height.
    let between = |(x, foot): (f64, f64), roof: f64| {
        let t = ((z - foot as f32) / (g.roof_corner - foot) as f32).clamp(0.0, 1.0);
        (x + (roof - x) * f64::from(t)) as f32
    };
    let (rear, front) = (between(g.rear_window, g.roof_rear), between(g.windscreen, g.roof_front));
    let belt = g.windscreen.1.max(g.rear_window.1) as f32;
    let t = ((z - belt) / (g.roof_corner as f32 - belt)).clamp(0.0, 1.0);
    let half = 0.437 + (0.345 - 0.437) * t;
    let rows = place.within(2, belt + 0.02, g.roof_corner as f32 - 0.012);
    // Side glass between the pillars, screens at both ends.
    let pillar = front - 0.30;
    let mut side =
        place.within(0, rear + 0.035, front - 0.035) * (1.0 - place.within(0, pillar, pillar + 0.025));
    if vehicle.class == VehicleClass::Van && vehicle.id.is_multiple_of(2) {
        // Every other van carries goods: no windows behind the driver.
        side *= place.within(0, pillar, 1.0);
    }
    let on_side = ((place.p[1].abs() - half + 0.03) / 0.03).clamp(0.0, 1.0);
    let screen = place.beside(1, 0.0, half - 0.035);
    let glass = rows * (on_side * side + (1.0 - on_side) * screen).clamp(0.0, 1.0);
    let reflection = GLASS.map(|c| c * (1.0 + 0.9 * grain) + 0.05 * (z - 0.65));
    Paint { colour: mixed(vehicle.colour, reflection, glass), gloss: 0.06 + 0.22 * glass }
}

fn body(vehicle: &SimulatedVehicle, form: &Form, place: &SurfacePoint, grain: f32) -> Paint {
    let class = vehicle.class;
    let [x, y, z] = place.p;
    let mut colour = scaled(vehicle.colour, 1.0 + 0.04 * grain);
    let mut gloss = 0.08;
    let size = vehicle.size;
    let g = form.glasshouse.as_ref();
    // Seams of the doors and the sill.
    let flank = place.beside(1, 0.44, 1.0);
    let front = g.map_or(0.17, |g| g.windscreen.0 as f32 - 0.03);
    let seams = [front - 0.46, front - 0.235, front].map(|at| place.within(0, at - 0.0025, at + 0.0025));
    colour =
        mixed(colour, TRIM, 0.7 * flank * seams.iter().sum::<f32>().min(1.0) * place.within(2, 0.16, 0.62));
    colour = mixed(colour, TRIM, 0.8 * place.within(2, 0.0, 0.19));
    let handle = flank
        * (place.within(0, front - 0.44, front - 0.405) + place.within(0, front - 0.215, front - 0.18))
        * place.within(2, 0.545, 0.56);
    colour = mixed(colour, TRIM, 0.6 * handle);
    // Wheel arches: dark round the wheels.
    let radius = form.tyre_radius as f32 * size.height_m as f32;
    for axle in [form.front_axle, form.rear_axle] {
        let (along, up) = ((x - axle as f32) * size.length_m as f32, z * size.height_m as f32 - radius);
        let far = along.hypot(up);
        let reach = radius + 0.06;
        let soft = (place.width[0] * size.length_m as f32).max(0.01);
        colour = mixed(colour, TRIM, flank * ((reach - far) / soft + 0.5).clamp(0.0, 1.0));
    }
    // Lights hang under the corners of boot and bonnet.
    let lights = |corner: Option<f64>| corner.map_or((0.30, 0.42), |z| (z as f32 - 0.12, z as f32 - 0.005));
    let (low, high) = lights(g.map(|g| g.tail));
    if x < -0.42 {
        let lamp = place.within(0, -1.0, -0.44) * place.beside(1, 0.28, 0.47) * place.within(2, low, high);
        colour = mixed(colour, [0.62, 0.05, 0.05], lamp);
        let plate = place.within(0, -1.0, -0.45) * place.within(1, -0.145, 0.145);
        let rows = if g.is_some() { place.within(2, 0.345, 0.42) } else { place.within(2, 0.22, 0.27) };
        colour = mixed(colour, [0.90, 0.89, 0.80], plate * rows);
        colour = mixed(colour, TRIM, place.within(0, -1.0, -0.45) * place.within(2, 0.20, 0.27) * 0.8);
    }
    if x > 0.40 {
        let (low, high) = lights(g.map(|g| g.bonnet - 0.02));
        let lamp = place.within(0, 0.42, 1.0) * place.beside(1, 0.25, 0.45) * place.within(2, low, high);
        colour = mixed(colour, [0.88, 0.90, 0.93], lamp);
        let grille = place.within(0, 0.45, 1.0) * place.beside(1, 0.0, 0.22) * place.within(2, 0.30, 0.42);
        colour = mixed(colour, TRIM, grille);
        let plate = place.within(0, 0.46, 1.0) * place.within(1, -0.145, 0.145) * place.within(2, 0.23, 0.29);
        colour = mixed(colour, [0.90, 0.90, 0.86], plate);
    }
    // Windows of vehicles without a separate cabin.
    let glass = match class {
        VehicleClass::Truck => {
            let screen =
                place.within(0, 0.44, 1.0) * place.beside(1, 0.0, 0.43) * place.within(2, 0.55, 0.80);
            screen.max(flank * place.within(0, 0.36, 0.44) * place.within(2, 0.55, 0.78))
        }
        VehicleClass::Bus => {
            let panes = 1.0 - super::coverage::cover_periodic(x, 0.0, 0.012, 0.13, place.width[0]);
            let side = flank * place.within(0, -0.46, 0.44) * place.within(2, 0.42, 0.80) * panes;
            let ends = place.beside(0, 0.465, 1.0) * place.beside(1, 0.0, 0.42) * place.within(2, 0.40, 0.86);
            side.max(ends)
        }
        VehicleClass::Van if vehicle.body != Body::Usual => {
            // A caravan.
            let side = flank * (place.within(0, -0.40, -0.27) + place.within(0, 0.04, 0.20));
            let rear = place.within(0, -1.0, -0.47) * place.beside(1, 0.0, 0.33);
            side.max(rear) * place.within(2, 0.50, 0.76)
        }
        VehicleClass::Car | VehicleClass::Van | VehicleClass::Motorcycle => 0.0,
    };
    colour = mixed(colour, scaled(GLASS, 1.0 + 0.9 * grain + 0.3 * y), glass);
    gloss += 0.18 * glass;
    Paint { colour, gloss }
}
