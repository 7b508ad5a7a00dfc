//! Vehicles in the top view.

use motorcade_geometry::robust::upper_median_by;
use motorcade_vehicles::{Source, VehicleState, VehicleTrajectory};
use nalgebra::{Point3, Vector2};

/// P(moving) from which a vehicle is drawn as moving.
pub const MOVING: f64 = 0.5;

/// P(moving) below and above which a vehicle that is drawn as moving or as parked counts as doubtful in that.
const SURELY_MOVING: f64 = 0.95;
const SURELY_PARKED: f64 = 0.2;

/// Median score of a vehicle's boxes below which it is drawn faintly. Tracks keep weaker boxes than pictures usually show, so that
/// vehicles far away and half hidden ones are followed.
const DOUBTFUL_SCORE: f64 = 0.3;

/// True when the detector doubts a vehicle, by the scores of the boxes of its track.
pub fn is_doubtful(scores: impl Iterator<Item = f64>) -> bool {
    let mut scores: Vec<f64> = scores.collect();
    upper_median_by(&mut scores, f64::total_cmp).is_some_and(|median| median < DOUBTFUL_SCORE)
}

/// True when a vehicle that is drawn as moving may stand, or one that is drawn as parked may move.
pub fn is_unsure(p_moving: f64) -> bool {
    (SURELY_PARKED..SURELY_MOVING).contains(&p_moving)
}

/// Classes of a vehicle's drawings in the page: moving or parked, and its doubts.
pub(crate) fn kind(vehicle: &VehicleTrajectory) -> String {
    let mut kind = if is_moving(vehicle) { "moving" } else { "parked" }.to_owned();
    if is_unsure(vehicle.p_moving) {
        kind += " unsure";
    }
    let seen = vehicle.states.iter().filter(|s| s.source != Source::Predicted);
    if is_doubtful(seen.map(|s| s.score)) {
        kind += " doubtful";
    }
    kind
}

/// True when a vehicle is drawn as a path.
pub(crate) fn is_moving(vehicle: &VehicleTrajectory) -> bool {
    vehicle.p_moving > MOVING
}

/// Position in the top view: x right and z forward of the first camera \[m\].
pub(crate) fn position(state: &VehicleState) -> Vector2<f64> {
    state.world_from_vehicle.translation().xz()
}

/// Standard deviation of the position on the road \[m\].
pub(crate) fn sigma_m(state: &VehicleState) -> f64 {
    (state.covariance[(3, 3)] + state.covariance[(4, 4)]).max(0.0).sqrt()
}

/// The state with the smallest standard deviation.
pub(crate) fn most_certain(vehicle: &VehicleTrajectory) -> Option<&VehicleState> {
    vehicle.states.iter().min_by(|a, b| sigma_m(a).total_cmp(&sigma_m(b)))
}

/// Corners of the vehicle's footprint, then the middle of its front \[m\].
pub(crate) fn footprint(vehicle: &VehicleTrajectory, state: &VehicleState) -> [Vector2<f64>; 5] {
    let (l, w) = (0.5 * vehicle.size.length_m, 0.5 * vehicle.size.width_m);
    [(l, w), (l, -w), (-l, -w), (-l, w), (l, 0.0)]
        .map(|(x, y)| state.world_from_vehicle.transform_point(&Point3::new(x, y, 0.0)).coords.xz())
}
