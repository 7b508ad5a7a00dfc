//! Camera and vehicles in a frame between two that are estimated in full.

use motorcade_geometry::{Camera, Pose, lie::se3::adjoint};
use motorcade_odometry::{EgoFrame, FrameStatus};
use motorcade_perception::BoundingBox;
use motorcade_vehicles::{Source, VehicleState};
use nalgebra::Vector6;

use crate::estimator_options::OnlineOptions;
use crate::record::FrontEndView;

/// The camera at the newest frame of a view: at `base` it was estimated in full, from there on odometry is followed at the
/// scale of then. `None` where odometry does not connect the two.
pub(super) fn camera(view: &FrontEndView<'_>, base: usize, estimated: &EgoFrame) -> Option<EgoFrame> {
    let newest = view.frames.len() - 1;
    let (from, to) = (view.motion.frames.get(base)?, view.motion.frames.get(newest)?);
    let followed = matches!(to.status, FrameStatus::Tracked | FrameStatus::Standstill);
    if from.segment != to.segment || !followed {
        return None;
    }
    let (from, of_newest) = (view.motion.camera_from_world(base)?, view.motion.camera_from_world(newest)?);
    let step: Pose<Camera, Camera> = (from * of_newest.inverse()).scaled(estimated.scale);
    let transport = adjoint(step.inverse().isometry());
    let (before, after) = (estimated.covariance, to.covariance);
    let mut covariance = transport * before * transport.transpose();
    let along = Vector6::new(0.0, 0.0, 0.0, step.translation().x, step.translation().y, step.translation().z);
    covariance += along * along.transpose() * estimated.scale_sigma.powi(2);
    let metric = Vector6::new(1.0, 1.0, 1.0, estimated.scale, estimated.scale, estimated.scale);
    covariance += after.component_mul(&(metric * metric.transpose()));
    Some(EgoFrame {
        world_from_camera: estimated.world_from_camera * step,
        status: to.status,
        covariance,
        scale_measured: view.road_measurements.last().is_some_and(|m| m.frame == newest),
        road_normal: step.inverse().transform_vector(&estimated.road_normal),
        inliers: to.inliers,
        ..estimated.clone()
    })
}

/// A vehicle `elapsed_s` after a state, by constant speed and yaw rate; `bbox` and `score` are those of its box in the frame.
pub(super) fn vehicle(
    state: &VehicleState,
    frame: usize,
    elapsed_s: f64,
    (bbox, score): (BoundingBox, f64),
    options: &OnlineOptions,
) -> VehicleState {
    let (way_m, turned_rad) = (state.speed_mps * elapsed_s, state.yaw_rate_radps * elapsed_s);
    let tangent = Vector6::new(0.0, 0.0, turned_rad, way_m, 0.0, 0.0);
    let transport = adjoint(Pose::<Camera, Camera>::exp(&tangent).inverse().isometry());
    let mut covariance = transport * state.covariance * transport.transpose();
    let accelerated_m =
        if state.speed_mps == 0.0 { 0.0 } else { 0.5 * options.acceleration_sigma_mps2 * elapsed_s.powi(2) };
    covariance[(3, 3)] += (state.speed_sigma_mps * elapsed_s).powi(2) + accelerated_m.powi(2);
    VehicleState {
        frame,
        world_from_vehicle: state.world_from_vehicle.retract(&tangent),
        covariance,
        bbox: Some(bbox),
        score,
        source: Source::Predicted,
        measurement: None,
        observations: Vec::new(),
        ..state.clone()
    }
}
