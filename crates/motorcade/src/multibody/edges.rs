//! The edges of the multi-object graph, for the whole drive or a window of it.

use motorcade_graph::factors::Between;
use motorcade_graph::{Cauchy, Dcs, Factor, GemanMcClure, GraphError, Huber, Robust, VariableId};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{Measured, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix6, Vector6};

use super::motion_factors::{NoSideSlip, SteadyMotion};
use super::{GraphKernel, GraphOptions};

/// An edge, not yet in a graph.
pub(crate) type Edge = Box<dyn Factor>;

/// A vehicle that moves with less probability is one node.
const STANDING: f64 = 0.5;

/// True for a vehicle that is one node, seen from many cameras.
pub(crate) fn stands(vehicle: &VehicleTrajectory, options: &GraphOptions) -> bool {
    vehicle.p_moving < STANDING && !options.constant_weights
}

/// Camera–camera edges: odometry. `cameras[k]` is the node of frame k of `ego`.
pub(crate) fn of_cameras(
    cameras: &[VariableId],
    ego: &EgoTrajectory,
    options: &GraphOptions,
) -> Result<Vec<Edge>, GraphError> {
    if !options.camera_camera {
        return Ok(Vec::new());
    }
    let one =
        |(nodes, frames): (&[VariableId], &[motorcade_odometry::EgoFrame])| -> Result<Edge, GraphError> {
            let step = frames[0].world_from_camera.inverse() * frames[1].world_from_camera;
            let information = if options.constant_weights {
                Matrix6::identity() * options.lambda_camera
            } else {
                inverse(&frames[1].step_covariance)
            };
            Ok(Box::new(Between::new(nodes[0], nodes[1], *step.isometry(), information)?))
        };
    cameras.windows(2).zip(ego.frames.windows(2)).map(one).collect()
}

/// All edges of a vehicle; `nodes[i]` is that of its i-th state.
pub(crate) fn of_vehicle(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    cameras: &[VariableId],
    ego: &EgoTrajectory,
    options: &GraphOptions,
) -> Result<Vec<Edge>, GraphError> {
    let mut out = Vec::new();
    if options.camera_vehicle {
        out.extend(sightings(vehicle, nodes, cameras, options)?);
    }
    if options.vehicle_vehicle && !stands(vehicle, options) {
        out.extend(if options.constant_weights {
            road_plane_steps(vehicle, nodes, ego, options)?
        } else {
            motion(vehicle, nodes)
        });
    }
    out.extend(ties(vehicle, nodes, cameras, ego)?);
    Ok(out)
}

/// Camera–vehicle edges: what each frame says of the vehicle.
fn sightings(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    cameras: &[VariableId],
    options: &GraphOptions,
) -> Result<Vec<Edge>, GraphError> {
    let seen = vehicle.states.iter().filter(|s| s.measured.is_some()).count();
    // All views of a standing vehicle share their errors of size and slope.
    let share = if stands(vehicle, options) {
        options.correlated_frames.max(seen as f64 / 4.0)
    } else {
        options.correlated_frames
    };
    let one = |(state, node): (&VehicleState, &VariableId)| {
        state.measured.as_ref().map(|m| sighting(m, cameras[state.frame], *node, share, options))
    };
    vehicle.states.iter().zip(nodes).filter_map(one).collect()
}

fn sighting(
    measured: &Measured,
    camera: VariableId,
    vehicle: VariableId,
    share: f64,
    options: &GraphOptions,
) -> Result<Edge, GraphError> {
    let pose = *measured.camera_from_vehicle.isometry();
    if options.constant_weights {
        let near = pose.translation.vector.z <= options.near_limit_m;
        let lambda = if near { options.lambda_trusted } else { options.lambda_doubted };
        return Ok(Box::new(Between::new(camera, vehicle, pose, Matrix6::identity() * lambda)?));
    }
    let edge = Between::new(camera, vehicle, pose, inverse(&(measured.covariance * share)))?;
    let c = options.kernel_scale;
    Ok(match options.kernel {
        GraphKernel::None => Box::new(edge),
        GraphKernel::Huber => Box::new(Robust::new(edge, Huber { c })),
        GraphKernel::Cauchy => Box::new(Robust::new(edge, Cauchy { c })),
        GraphKernel::GemanMcClure => Box::new(Robust::new(edge, GemanMcClure { c })),
        GraphKernel::Dcs => Box::new(Robust::new(edge, Dcs { phi: c * c })),
    })
}

/// Vehicle–vehicle edges: steady motion, no side slip.
fn motion(vehicle: &VehicleTrajectory, nodes: &[VariableId]) -> Vec<Edge> {
    // Per step of a tenth of a second: 0.03 rad of yaw (0.3 rad/s per s over 0.1 s), 1.5 m/s² along, 0.5 m/s² across.
    let sigmas = [0.01, 0.01, 0.004, 0.02, 0.01, 0.01];
    let information = Matrix6::from_diagonal(&Vector6::from_fn(|k, _| 1.0 / (sigmas[k] * sigmas[k])));
    let mut out: Vec<Edge> = Vec::new();
    for w in nodes.windows(3) {
        out.push(Box::new(SteadyMotion::new([w[0], w[1], w[2]], &information)));
    }
    for (w, state) in nodes.windows(2).zip(&vehicle.states) {
        // Standing still a vehicle's heading does not show in its motion; the factor then says nothing of it anyway.
        let sideways = if state.speed_mps.abs() > 1.0 { 0.02 } else { 0.05 };
        out.push(Box::new(NoSideSlip::new([w[0], w[1]], [0.01, 0.01, sideways, 0.03])));
    }
    out
}

/// The paper's vehicle–vehicle edges: differences of road-plane places, registered by odometry.
fn road_plane_steps(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    ego: &EgoTrajectory,
    options: &GraphOptions,
) -> Result<Vec<Edge>, GraphError> {
    let place = |s: &VehicleState| {
        s.measured.map(|m| (ego.frames[s.frame].world_from_camera * m.camera_from_vehicle, m))
    };
    let mut out: Vec<Edge> = Vec::new();
    for (w, pair) in nodes.windows(2).zip(vehicle.states.windows(2)) {
        let (Some((a, _)), Some((b, seen))) = (place(&pair[0]), place(&pair[1])) else { continue };
        let far = seen.camera_from_vehicle.translation().z > options.near_limit_m;
        let lambda = if far { options.lambda_trusted } else { options.lambda_doubted };
        let step = *(a.inverse() * b).isometry();
        out.push(Box::new(Between::new(w[0], w[1], step, Matrix6::identity() * lambda)?));
    }
    Ok(out)
}

/// A weak tie of every vehicle node to its camera at the front end's estimate, so that no choice of edges leaves a
/// node free: ten metres, one radian.
fn ties(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    cameras: &[VariableId],
    ego: &EgoTrajectory,
) -> Result<Vec<Edge>, GraphError> {
    let weak = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, 0.01, 0.01, 0.01));
    let mut out: Vec<Edge> = Vec::new();
    for (k, (state, node)) in vehicle.states.iter().zip(nodes).enumerate() {
        if k > 0 && nodes[k - 1] == *node {
            continue;
        }
        let pose = ego.frames[state.frame].world_from_camera.inverse() * state.world_from_vehicle;
        out.push(Box::new(Between::new(cameras[state.frame], *node, *pose.isometry(), weak)?));
    }
    Ok(out)
}

/// Inverse of a covariance; a singular one is loosened until it has one.
fn inverse(covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let mut loose = (covariance + covariance.transpose()) * 0.5;
    for _ in 0..8 {
        if let Some(factor) = loose.cholesky() {
            let information = factor.inverse();
            return (information + information.transpose()) * 0.5;
        }
        loose += Matrix6::identity() * (1e-9 + 1e-3 * loose.trace().abs());
    }
    Matrix6::identity()
}
