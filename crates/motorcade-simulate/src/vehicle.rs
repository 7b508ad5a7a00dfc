//! Vehicles of a drive.

use motorcade_geometry::{Pose, Vehicle};
use motorcade_perception::VehicleClass;
use motorcade_shape::{Blueprint, BodyType, Layout};
use motorcade_vehicles::{Dimensions, size_prior};
use nalgebra::Point3;
use rand::Rng;

use crate::form::{self, Form};
use crate::hash;
use crate::site::Site;
use crate::trailer::TrailerKind;

/// Body of a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// That of its class.
    #[default]
    Usual,
    /// The tractor of a semi-trailer.
    Tractor,
    /// A trailer.
    Trailer {
        /// Its kind.
        kind: TrailerKind,
        /// Identity of the vehicle that tows it.
        towed_by: u32,
    },
}

/// A vehicle with its true path.
#[derive(Clone, Debug)]
pub struct SimulatedVehicle {
    /// Identity, 0 and up.
    pub id: u32,
    /// Class; of a trailer the one that a detector gives it.
    pub class: VehicleClass,
    /// True size.
    pub size: Dimensions,
    /// Body type of the shape prior, stretched to its size; `None` for trucks, buses and motorcycles, which the prior does
    /// not have.
    pub body_type: Option<BodyType>,
    /// A drawing of its own, of its size; without one, the average of its body type stretched to its size.
    pub blueprint: Option<Blueprint>,
    /// Its body.
    pub body: Body,
    /// Body colour, red, green, blue, 0 to 1.
    pub colour: [f32; 3],
    /// `site_from_vehicle` at each frame; `None` where it is absent.
    pub poses: Vec<Option<Pose<Site, Vehicle>>>,
    /// Speed at each frame \[m/s\].
    pub speeds_m_s: Vec<f64>,
}

/// Ratio of height to width above which a drawing is that of an upright van.
const UPRIGHT: f64 = 1.01;
/// Half width of the roof of an upright van and of all others.
const UPRIGHT_ROOF_HALF: f64 = 0.43;
const ROOF_HALF: f64 = 0.345;

impl SimulatedVehicle {
    /// Class in labels, by KITTI's names: trailers are `Misc`.
    pub(crate) fn label(&self) -> &'static str {
        if matches!(self.body, Body::Trailer { .. }) { "Misc" } else { self.class.name() }
    }

    pub(crate) fn form(&self) -> Form {
        match (&self.blueprint, self.body) {
            (_, Body::Trailer { kind, .. }) => kind.form(),
            (Some(plan), _) => Form::drawn(plan),
            (None, _) => Form::of(self.class, self.body_type, &self.size),
        }
    }

    /// Half width of the roof at its corners, as a fraction of the width; those of upright vans are wide.
    pub(crate) fn roof_half(&self) -> f64 {
        let upright = self.blueprint.is_some() && self.size.height_m > UPRIGHT * self.size.width_m;
        if upright { UPRIGHT_ROOF_HALF } else { ROOF_HALF }
    }

    /// Moves the roof's corners out to those of an upright van.
    fn widened(&self, mut points: Vec<Point3<f64>>, layout: Layout) -> Vec<Point3<f64>> {
        let corners: &[usize] = match layout {
            Layout::Car36 => &[13, 14, 31, 32],
            Layout::Car14 => &[10, 11, 12, 13],
        };
        for corner in corners {
            if let Some(point) = points.get_mut(*corner) {
                point.y *= self.roof_half() / ROOF_HALF;
            }
        }
        points
    }

    /// Keypoints (vehicle frame) \[m\]; `None` for vehicles that the prior does not have.
    pub(crate) fn keypoints(&self, layout: Layout) -> Option<Vec<Point3<f64>>> {
        let body = self.body_type?;
        Some(match &self.blueprint {
            Some(plan) => self.widened(plan.keypoints(layout), layout),
            None => form::keypoints(body, &self.size, layout),
        })
    }
}

/// Colours with the shares of cars sold: mostly white, grey and black.
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

/// Random size by the prior of the class, truncated at two standard deviations.
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

/// Random colour of a class.
pub(crate) fn draw_colour(class: VehicleClass, rng: &mut impl Rng) -> [f32; 3] {
    let bright = [COLOURS[2], COLOURS[0], [0.80, 0.66, 0.20], [0.25, 0.42, 0.66]];
    match class {
        VehicleClass::Car | VehicleClass::Motorcycle => COLOURS[rng.random_range(0..COLOURS.len())],
        _ => bright[rng.random_range(0..bright.len())],
    }
}
