//! A vehicle over its track.

use motorcade::{RunResult, relative_sigma_m};
use motorcade_vehicles::{Dimensions, Source, VehicleState, VehicleTrajectory};
use nalgebra::Vector3;
use serde_json::{Value, json};

use super::rounded;
use crate::hue::hue;
use crate::outline::{kind, position};

/// Facts and columns with a value a state.
pub(super) fn vehicle(result: &RunResult, vehicle: &VehicleTrajectory, index: usize) -> Value {
    let column = |value: &dyn Fn(&VehicleState) -> f64, digits| -> Vec<f64> {
        vehicle.states.iter().map(|s| rounded(value(s), digits)).collect()
    };
    let forward = |s: &VehicleState| s.world_from_vehicle.rotation_matrix() * Vector3::x();
    let three = |d: Dimensions| [d.length_m, d.width_m, d.height_m].map(|v| rounded(v, 2));
    json!({
        "id": vehicle.id,
        "class": vehicle.class.name(),
        "hue": hue(index),
        "kind": kind(vehicle),
        "p_moving": rounded(vehicle.p_moving, 2),
        "size": three(vehicle.size),
        "size_sigma": three(vehicle.size_sigma()),
        "row": vehicle.states.iter().map(|s| s.frame).collect::<Vec<_>>(),
        "seen": vehicle.states.iter().map(|s| u8::from(s.source != Source::Predicted)).collect::<Vec<_>>(),
        "x": column(&|s| position(s).x, 2),
        "z": column(&|s| position(s).y, 2),
        "yaw": column(&|s| forward(s).x.atan2(forward(s).z), 3),
        // The vehicle's axes lie in the road: forward and left, turned onto the map.
        "xx": column(&|s| on_map(s)[0], 3),
        "xz": column(&|s| on_map(s)[1], 3),
        "zz": column(&|s| on_map(s)[2], 3),
        "speed": column(&|s| s.speed_mps, 2),
        "speed_sigma": column(&|s| s.speed_sigma_mps, 3),
        "distance": column(&|s| distance(result, s).0, 2),
        "distance_sigma": column(&|s| distance(result, s).1, 2),
    })
}

/// Covariance of the position on the map: xx, xz, zz \[m²\].
fn on_map(state: &VehicleState) -> [f64; 3] {
    let r = state.world_from_vehicle.rotation_matrix();
    let world = r * state.covariance.fixed_view::<3, 3>(3, 3) * r.transpose();
    [world[(0, 0)], world[(0, 2)], world[(2, 2)]]
}

/// Distance from the camera to the centre, along the road, and its standard deviation \[m\].
fn distance(result: &RunResult, state: &VehicleState) -> (f64, f64) {
    let Some(ego) = result.ego.frames.get(state.frame) else { return (f64::NAN, f64::NAN) };
    let camera_from_vehicle = ego.world_from_camera.inverse() * state.world_from_vehicle;
    let own = std::array::from_fn(|k| state.covariance[(3 + k, 3 + k)].max(0.0).sqrt());
    let [forward, left, _] = relative_sigma_m(&camera_from_vehicle, &ego.covariance, own);
    let apart = camera_from_vehicle.translation();
    // Direction of view towards the vehicle, in the vehicle's axes.
    let towards = camera_from_vehicle.rotation_matrix().transpose() * apart;
    let length = towards.x.hypot(towards.y).max(1e-9);
    let sigma = (forward * towards.x / length).hypot(left * towards.y / length);
    (length, sigma)
}
