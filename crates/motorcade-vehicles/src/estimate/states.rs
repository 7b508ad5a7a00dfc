//! States of a vehicle in all frames, from its motion and headings.

use motorcade_geometry::{Pose, Vehicle, World};
use nalgebra::{Matrix3, Matrix6, Point3};

use super::input::TrackInput;
use super::measurements::{fused, observations};
use super::views::Views;
use crate::ground::GroundFrame;
use crate::motion::KinematicState;
use crate::options::HeadingOptions;
use crate::outline::{box_in_picture, upright_pose};
use crate::time::interval_s;
use crate::track::TrackBox;
use crate::trajectory::{PoseObservation, Source, VehicleState};

/// States of all frames; headings are relative to each frame's camera.
pub(super) fn assemble(
    input: &TrackInput<'_>,
    views: &Views,
    states: &[KinematicState],
    (headings, heading_variance): (&[f64], f64),
) -> Vec<VehicleState> {
    let TrackInput { camera, grounds, track, external, start, .. } = *input;
    let boxes = by_frame(&track.boxes, |b| b.frame, start, states.len());
    let external = by_frame(&external.views, |v| v.frame, start, states.len());
    let mut observed: Vec<Vec<PoseObservation>> = vec![Vec::new(); states.len()];
    for (frame, observation) in observations(input, views, headings) {
        if let Some(slot) = observed.get_mut(frame - start) {
            slot.push(observation);
        }
    }
    let mut out: Vec<VehicleState> = Vec::with_capacity(states.len());
    let options = &input.options.advanced.heading;
    for (k, ((state, heading), observations)) in states.iter().zip(headings).zip(observed).enumerate() {
        let ground = &grounds[start + k];
        let camera_from_world = ground.world_from_camera.inverse();
        let position = camera_from_world.transform_point(&Point3::from(state.position));
        let forward = ground.direction_of(*heading);
        let camera_from_vehicle = upright_pose(&position, &forward, &ground.up);
        let world_from_vehicle = ground.world_from_camera * camera_from_vehicle;
        let direction = ground.world_from_camera.transform_vector(&forward);
        let speed_mps = state.velocity.dot(&direction);
        let velocity_covariance: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let speed_sigma_mps = direction.dot(&(velocity_covariance * direction)).max(0.0).sqrt();
        let (yaw_rate_radps, dt) = match out.get(earlier(grounds, start, k, options.yaw_rate_time_s)) {
            Some(before) => {
                let turn = before.world_from_vehicle.rotation().inverse() * world_from_vehicle.rotation();
                let dt = (ground.time_s - grounds[before.frame].time_s).max(1e-3);
                (turn.scaled_axis().z / dt, dt)
            }
            None => (0.0, options.yaw_rate_time_s),
        };
        out.push(VehicleState {
            frame: start + k,
            world_from_vehicle,
            covariance: pose_covariance(state, &world_from_vehicle, speed_mps, dt, options),
            bbox: match boxes[k] {
                Some(b) => Some(b.observed.bbox),
                None => box_in_picture(camera, &camera_from_vehicle, track.class, &views.size.size),
            },
            score: boxes[k].map_or(0.0, |b: &TrackBox| b.score),
            speed_mps,
            speed_sigma_mps,
            yaw_rate_radps,
            source: match (boxes[k], external[k]) {
                (_, Some(view)) => view.source,
                (Some(_), None) => Source::Box,
                (None, None) => Source::Predicted,
            },
            measurement: fused(input, views, start + k, &forward),
            observations,
            heading_variance,
            rival: None,
        });
    }
    out
}

/// Index (from `start`) of the latest state before `k` that is old enough for a yaw rate, else of the first; `k` for the first state.
fn earlier(grounds: &[GroundFrame], start: usize, k: usize, least_age_s: f64) -> usize {
    let age_s = |i: &usize| interval_s(grounds[start + i].time_s, grounds[start + k].time_s);
    (0..k).rev().find(|i| age_s(i) >= least_age_s).unwrap_or(0)
}

/// The first item of each of `count` frames from `start` on.
fn by_frame<T>(items: &[T], frame: fn(&T) -> usize, start: usize, count: usize) -> Vec<Option<&T>> {
    let mut slots = vec![None; count];
    for item in items {
        if let Some(slot) = slots.get_mut(frame(item) - start) {
            slot.get_or_insert(item);
        }
    }
    slots
}

/// Covariance (6×6 `[ω, ν]`, vehicle frame) of a state: the heading is known as well as the direction of travel.
fn pose_covariance(
    state: &KinematicState,
    world_from_vehicle: &Pose<World, Vehicle>,
    speed_mps: f64,
    dt: f64,
    options: &HeadingOptions,
) -> Matrix6<f64> {
    let r = world_from_vehicle.rotation_matrix();
    let position: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let velocity: Matrix3<f64> = r.transpose() * state.covariance.fixed_view::<3, 3>(3, 3) * r;
    let of_travel = velocity[(1, 1)].max(0.0).sqrt() / speed_mps.abs().max(options.hold_speed_mps);
    let heading = of_travel.max(options.state_sigma_rad).min(options.state_most_sigma_rad);
    let mut out = Matrix6::zeros();
    out[(0, 0)] = options.state_tilt_sigma_rad.powi(2);
    out[(1, 1)] = options.state_tilt_sigma_rad.powi(2);
    out[(2, 2)] = heading.powi(2) + (options.state_drift_radps * dt).powi(2);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r.transpose() * position * r));
    out
}
