//! Vehicles of training streets: any body of the shape family with varied lengths, upright vans, and others.

use motorcade_perception::VehicleClass;
use motorcade_shape::{Blueprint, BodyType, CarModel, FAMILY};
use motorcade_vehicles::Dimensions;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::vehicle::draw_size;

/// Body types of the labels: those of the shape family, upright vans, and vehicles without keypoints.
pub(super) const BODY_LABELS: [&str; 9] =
    ["city", "hatchback", "saloon", "estate", "suv", "van", "coupe", "panel_van", "other"];

/// A vehicle of a training street.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub class: VehicleClass,
    pub size: Dimensions,
    pub body_type: Option<BodyType>,
    pub blueprint: Option<Blueprint>,
    /// Index into [`BODY_LABELS`].
    pub label: usize,
}

impl Model {
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        let uniform: f64 = rng.random();
        if uniform < 0.09 {
            return Self::of(VehicleClass::Van, BodyType::Van, 7, panel_van(rng));
        }
        if uniform < 0.13 {
            let class = [VehicleClass::Truck, VehicleClass::Truck, VehicleClass::Bus][rng.random_range(0..3)];
            let size = draw_size(class, rng);
            return Self { class, size, body_type: None, blueprint: None, label: 8 };
        }
        let body = family_body(rng);
        let models: Vec<&CarModel> = FAMILY.iter().filter(|m| m.body_type == body).collect();
        let plan = models.get(rng.random_range(0..models.len().max(1))).map(|m| m.blueprint);
        let Some(plan) = plan else { return Self::of(VehicleClass::Van, BodyType::Van, 7, panel_van(rng)) };
        let label = BodyType::ALL.iter().position(|b| *b == body).unwrap_or(0);
        Self::of(VehicleClass::Car, body, label, varied(plan, rng))
    }

    fn of(class: VehicleClass, body: BodyType, label: usize, plan: Blueprint) -> Self {
        let size = Dimensions { length_m: plan.length_m, width_m: plan.width_m, height_m: plan.height_m };
        Self { class, size, body_type: Some(body), blueprint: Some(plan), label }
    }
}

/// Random body type, its share of traffic flattened: rare bodies get more training images than their share.
fn family_body(rng: &mut ChaCha8Rng) -> BodyType {
    let weight = |b: &BodyType| b.share().sqrt();
    let mut rest = rng.random::<f64>() * BodyType::ALL.iter().map(weight).sum::<f64>();
    let found = BodyType::ALL.into_iter().find(|b| {
        rest -= weight(b);
        rest < 0.0
    });
    found.unwrap_or(BodyType::Hatchback)
}

/// The drawing with all lengths varied slightly.
fn varied(plan: Blueprint, rng: &mut ChaCha8Rng) -> Blueprint {
    let (x, y, z) =
        (rng.random_range(0.96..1.04), rng.random_range(0.97..1.03), rng.random_range(0.95..1.06));
    let mut shift = |most: f64| rng.random_range(-most..most);
    Blueprint {
        length_m: plan.length_m * x,
        width_m: plan.width_m * y,
        height_m: plan.height_m * z,
        wheelbase_m: plan.wheelbase_m * x,
        front_overhang_m: plan.front_overhang_m * x + shift(0.04),
        tyre_diameter_m: plan.tyre_diameter_m + shift(0.03),
        bonnet_height_m: plan.bonnet_height_m * z + shift(0.05),
        windscreen_base_m: plan.windscreen_base_m * x + shift(0.08),
        windscreen_base_height_m: plan.windscreen_base_height_m * z + shift(0.03),
        roof_front_m: plan.roof_front_m * x + shift(0.08),
        roof_rear_m: plan.roof_rear_m * x + shift(0.06),
        rear_window_base_m: plan.rear_window_base_m * x + shift(0.04),
        rear_window_base_height_m: plan.rear_window_base_height_m * z + shift(0.04),
        tail_height_m: plan.tail_height_m * z + shift(0.05),
    }
}

/// Delivery vans and minibuses, which the family does not have; lengths estimated by eye from common ones.
fn panel_van(rng: &mut ChaCha8Rng) -> Blueprint {
    let (x, z) = (rng.random_range(0.92..1.08), rng.random_range(0.93..1.06));
    let [length, width, height, wheelbase, overhang, tyre, bonnet, screen, screen_z] = [
        [5.90, 1.99, 2.60, 3.66, 1.00, 0.69, 1.12, -0.25, 1.38],
        [4.90, 1.90, 1.97, 3.00, 0.91, 0.65, 1.05, -0.20, 1.25],
        [5.40, 2.05, 2.45, 3.45, 0.95, 0.68, 1.15, -0.30, 1.40],
        [4.75, 1.90, 1.93, 3.20, 0.86, 0.64, 1.03, -0.10, 1.22],
    ][rng.random_range(0..4)];
    let rear = length - wheelbase - overhang;
    let mut shift = |most: f64| rng.random_range(-most..most);
    Blueprint {
        length_m: length * x,
        width_m: width,
        height_m: height * z,
        wheelbase_m: wheelbase * x,
        front_overhang_m: overhang * x + shift(0.04),
        tyre_diameter_m: tyre + shift(0.02),
        bonnet_height_m: bonnet + shift(0.06),
        windscreen_base_m: screen + shift(0.08),
        windscreen_base_height_m: screen_z + shift(0.05),
        roof_front_m: screen + screen_run_m(height),
        roof_rear_m: (rear - 0.10) * x + shift(0.05),
        rear_window_base_m: (rear - 0.05) * x,
        rear_window_base_height_m: screen_z + shift(0.08),
        tail_height_m: bonnet - 0.05 + shift(0.10),
    }
}

/// Horizontal extent of a van's windscreen behind its base \[m\]: larger for higher vans.
fn screen_run_m(height_m: f64) -> f64 {
    0.2 + 0.3 * height_m
}
