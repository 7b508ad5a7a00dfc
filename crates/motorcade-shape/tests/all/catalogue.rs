//! The family of cars against figures of real cars that somebody else published.
//!
//! Length, width and axle distances of the PyPI package `commonroad-vehicle-models` 3.0.2 (BSD licence), files
//! `parameters_vehicle1.yaml` to `3`, after Althoff and Würsching, "CommonRoad: Vehicle Models", 2020, table 6. The cars are older
//! than ours and narrower, so what must agree are the proportions of their kind, within what cars of a kind differ by.
#![allow(clippy::unwrap_used, reason = "a test")]

use motorcade_shape::{BodyType, CarModel, FAMILY};

/// A published car: name, kind, length, width, wheelbase (front plus rear axle to the centre of gravity) \[m\].
type Published = (&'static str, BodyType, f64, f64, f64);

const PUBLISHED: [Published; 3] = [
    ("Ford Escort", BodyType::Hatchback, 4.298, 1.674, 0.883_92 + 1.508_76),
    ("BMW 320i", BodyType::Saloon, 4.508, 1.61, 1.156_196 + 1.422_717),
    ("VW Vanagon", BodyType::Van, 4.569, 1.844, 1.150_792 + 1.321_136),
];

/// The car of the same kind whose length and wheelbase are nearest.
fn nearest(published: &Published) -> &'static CarModel {
    let (_, kind, length, _, wheelbase) = published;
    let off = |m: &CarModel| (m.blueprint.length_m - length).hypot(m.blueprint.wheelbase_m - wheelbase);
    let same = FAMILY.iter().filter(|m| m.body_type == *kind);
    same.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
}

#[test]
fn published_cars_have_a_relative_in_the_family() {
    for published in &PUBLISHED {
        let (name, _, length, width, wheelbase) = published;
        let (model, found) = (nearest(published).name, nearest(published).blueprint);
        assert!(
            (found.length_m / length - 1.0).abs() < 0.06,
            "{name} and {model}: {} m long",
            found.length_m
        );
        // Crash rules made cars of the same length a tenth wider since 1990; none of ours is narrower than they were.
        let wider = found.width_m / width - 1.0;
        assert!((-0.03..0.14).contains(&wider), "{name} and {model}: wider by {wider}");
        // Axles moved towards the bumpers; the Vanagon has its driver over the front axle.
        let ratio = (found.wheelbase_m / found.length_m) / (wheelbase / length) - 1.0;
        assert!((-0.03..0.16).contains(&ratio), "{name} and {model}: wheelbase over length {ratio}");
    }
}
