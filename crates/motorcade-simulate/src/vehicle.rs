//! Vehicles of a drive.

use motorcade_geometry::{Pose, Vehicle};
use motorcade_perception::VehicleClass;
use motorcade_shape::BodyType;
use motorcade_vehicles::{Dimensions, size_prior};
use rand::Rng;

use crate::form::Form;
use crate::hash;
use crate::site::Site;

/// A vehicle with its true path.
#[derive(Clone, Debug)]
pub struct SimulatedVehicle {
    /// Identity, 0 and up.
    pub id: u32,
    /// Kind.
    pub class: VehicleClass,
    /// True size.
    pub size: Dimensions,
    /// Which body of the shape prior it has, stretched to its size; `None` where the prior has none: trucks, buses,
    /// motorcycles.
    pub body_type: Option<BodyType>,
    /// Body colour, red, green, blue, 0 to 1.
    pub colour: [f32; 3],
    /// `site_from_vehicle` at each frame; `None` where it is not in the world.
    pub poses: Vec<Option<Pose<Site, Vehicle>>>,
    /// Speed at each frame \[m/s\].
    pub speeds_m_s: Vec<f64>,
}

impl SimulatedVehicle {
    pub(crate) fn form(&self) -> Form {
        Form::of(self.class, self.body_type, &self.size)
    }
}

/// Colours of cars as they are sold: mostly no colours.
const COLOURS: [[f32; 3]; 10] = [
    [0.72, 0.73, 0.75],
    [0.50, 0.52, 0.54],
    [0.88, 0.88, 0.87],
    [0.13, 0.13, 0.15],
    [0.20, 0.22, 0.25],
    [0.16, 0.25, 0.48],
    [0.55, 0.09, 0.09],
    [0.30, 0.36, 0.30],
    [0.62, 0.56, 0.45],
    [0.22, 0.38, 0.58],
];

/// A size of the class: its prior, cut at two standard deviations.
pub(crate) fn draw_size(class: VehicleClass, rng: &mut impl Rng) -> Dimensions {
    let prior = size_prior(class);
    let mut draw = |mean: f64, sigma: f64| {
        let z = f64::from(hash::normal(rng.random())).clamp(-2.0, 2.0);
        mean + 0.8 * sigma * z
    };
    Dimensions {
        length_m: draw(prior.mean.length_m, prior.sigma.length_m),
        width_m: draw(prior.mean.width_m, prior.sigma.width_m),
        height_m: draw(prior.mean.height_m, prior.sigma.height_m),
    }
}

/// A colour for a class.
pub(crate) fn draw_colour(class: VehicleClass, rng: &mut impl Rng) -> [f32; 3] {
    let bright = [COLOURS[2], COLOURS[0], [0.80, 0.66, 0.20], [0.25, 0.42, 0.66]];
    match class {
        VehicleClass::Car | VehicleClass::Motorcycle => COLOURS[rng.random_range(0..COLOURS.len())],
        _ => bright[rng.random_range(0..bright.len())],
    }
}
