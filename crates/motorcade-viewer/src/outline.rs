//! Vehicles in the top view.

use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Point3, Vector2};

/// P(moving) from which a vehicle is drawn as moving.
pub const MOVING: f64 = 0.5;

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
