//! Speed of the camera, and the vehicle ahead of it: distance, closing speed, time to collision.

use motorcade_geometry::{Pose, World};
use motorcade_odometry::EgoFrame;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::Point2;

use crate::config::Config;
use crate::path_ahead::PathAhead;
use crate::relative::relative_sigma_m;
use crate::result::RunResult;

/// A value and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// Speeds in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSpeeds {
    /// Speed of the camera \[m/s\].
    pub speed_mps: Estimated,
    /// The nearest vehicle in the path of the camera.
    pub ahead: Option<VehicleAhead>,
}

/// The vehicle ahead.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleAhead {
    /// Its identity.
    pub id: usize,
    /// Kind of vehicle.
    pub class: VehicleClass,
    /// Way along the path from the camera to its nearest end \[m\].
    pub distance_m: Estimated,
    /// Speed at which the distance shrinks \[m/s\].
    pub closing_mps: Estimated,
    /// Distance over the camera's speed \[s\]; `None` when the camera stands.
    pub time_gap_s: Option<Estimated>,
    /// Distance over the closing speed \[s\]; `None` when the distance does not shrink by more than one standard deviation.
    pub time_to_collision_s: Option<Estimated>,
}

/// Speeds in every frame, by `outputs` of the configuration. The path of the camera is where it drove later, and straight on at the end of
/// the drive; a vehicle whose centre lies within the half width of the own lane from it is in it.
pub fn speeds(result: &RunResult, config: &Config) -> Vec<FrameSpeeds> {
    let options = &config.outputs;
    let path = PathAhead::new(result, &options.advanced);
    let mut by_frame: Vec<Vec<(&VehicleTrajectory, &VehicleState)>> = vec![Vec::new(); result.frames.len()];
    for vehicle in &result.vehicles {
        for state in &vehicle.states {
            if let Some(frame) = by_frame.get_mut(state.frame) {
                frame.push((vehicle, state));
            }
        }
    }
    let one = |(frame, vehicles): (usize, &Vec<(&VehicleTrajectory, &VehicleState)>)| {
        let speed_mps = camera_speed(result, frame, options.speed_time_s);
        let candidate = |(v, s): &(&VehicleTrajectory, &VehicleState)| {
            ahead(&path, &result.ego.frames[frame], v, s, speed_mps, config)
        };
        let ahead = vehicles.iter().filter_map(candidate);
        let ahead = ahead.min_by(|a, b| a.distance_m.value.total_cmp(&b.distance_m.value));
        FrameSpeeds { speed_mps, ahead }
    };
    by_frame.iter().enumerate().map(one).collect()
}

/// Speed of the camera around a frame. Errors of the scale are common to neighbouring frames, those of its steps are not.
fn camera_speed(result: &RunResult, frame: usize, speed_time_s: f64) -> Estimated {
    let time_s = |k: usize| result.frames[k].timestamp_ns as f64 * 1e-9;
    let now = time_s(frame);
    let near = |k: &usize| (time_s(*k) - now).abs() <= 0.5 * speed_time_s + 1e-6;
    let last_frame = result.frames.len().saturating_sub(1);
    let mut first = (0..frame).rev().take_while(near).last().unwrap_or(frame);
    let mut last = (frame + 1..=last_frame).take_while(near).last().unwrap_or(frame);
    if first == last {
        (first, last) = (frame.saturating_sub(1), (frame + 1).min(last_frame));
    }
    let duration_s = time_s(last) - time_s(first);
    if duration_s <= 0.0 {
        return Estimated { value: 0.0, sigma: f64::INFINITY };
    }
    let frames = &result.ego.frames[first..=last];
    let way_m: f64 = (first + 1..=last).map(|k| result.way_m(k)).sum();
    let variance: f64 = frames[1..].iter().map(|f| f.step_covariance[(5, 5)].max(0.0)).sum();
    let scale = frames.iter().map(|f| f.scale_sigma.hypot(f.scale_bias_sigma)).fold(0.0, f64::max);
    let value = way_m / duration_s;
    Estimated { value, sigma: (variance.sqrt() / duration_s).hypot(scale * value) }
}

/// A vehicle as the one ahead; `None` when it is beside or behind, or comes the other way.
fn ahead(
    path: &PathAhead,
    camera: &EgoFrame,
    vehicle: &VehicleTrajectory,
    state: &VehicleState,
    own: Estimated,
    config: &Config,
) -> Option<VehicleAhead> {
    let pose = &state.world_from_vehicle;
    let place = path.locate(state.frame, &ground(pose))?;
    let forward = pose.rotation_matrix().column(0).into_owned();
    let along = (forward.x * place.direction.x + forward.z * place.direction.y)
        / forward.x.hypot(forward.z).max(1e-9);
    let oncoming = along < 0.0 && vehicle.p_moving > 0.5;
    if place.offset_m.abs() > config.vehicles.advanced.box_fit.own_lane_half_width_m || oncoming {
        return None;
    }
    let across = (1.0 - along * along).max(0.0).sqrt();
    let size = &vehicle.size;
    let reach_m = 0.5 * (size.length_m * along.abs() + size.width_m * across);
    let centre_m = place.way_m;
    if centre_m + reach_m <= 0.0 {
        return None;
    }
    let camera_from_vehicle = camera.world_from_camera.inverse() * *pose;
    let sigma_m = [3, 4, 5].map(|k| state.covariance[(k, k)].max(0.0).sqrt());
    let [forward_m, left_m, _] = relative_sigma_m(&camera_from_vehicle, &camera.covariance, sigma_m);
    let sigma = ((forward_m * along).powi(2)
        + (left_m * across).powi(2)
        + 0.25 * vehicle.size_covariance[(0, 0)].max(0.0))
    .sqrt();
    let distance_m = Estimated { value: (centre_m - reach_m).max(0.0), sigma };
    let closing_mps = Estimated {
        value: own.value - state.speed_mps * along,
        sigma: own.sigma.hypot(state.speed_sigma_mps * along),
    };
    let standing_mps = config.outputs.standing_mps;
    Some(VehicleAhead {
        id: vehicle.id,
        class: vehicle.class,
        distance_m,
        closing_mps,
        time_gap_s: (own.value > standing_mps).then(|| ratio(distance_m, own)),
        time_to_collision_s: (closing_mps.value > closing_mps.sigma.max(standing_mps))
            .then(|| ratio(distance_m, closing_mps)),
    })
}

/// Coordinates in the horizontal plane of the world, whose y axis points down.
fn ground<From>(pose: &Pose<World, From>) -> Point2<f64> {
    let t = pose.translation();
    Point2::new(t.x, t.z)
}

/// a / b, to first order.
fn ratio(a: Estimated, b: Estimated) -> Estimated {
    let value = a.value / b.value;
    Estimated { value, sigma: (a.sigma / b.value).hypot(value * b.sigma / b.value) }
}
