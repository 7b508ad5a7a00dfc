//! Camera–vehicle edges, and the priors of a vehicle.

use motorcade_geometry::{Pose, Vehicle, World};
use motorcade_graph::factors::Between;
use motorcade_graph::{GraphError, VariableId};
use motorcade_vehicles::{PoseObservation, VehicleMeasurement, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix6, Vector6};

use super::edge::{Edge, EdgeContext, inverse, is_static, weighted};
use super::motion::{motion_model, road_plane_steps};
use crate::classes::EdgeClass;
use crate::scaled_pose_factor::ScaledPoseFactor;
use crate::track_scales::TrackScales;

/// The nodes of a vehicle.
#[derive(Clone, Copy)]
pub(crate) struct TrackNodes<'a> {
    /// One for each state; a static vehicle repeats its node.
    pub(crate) nodes: &'a [VariableId],
    /// Starting values of the nodes.
    pub(crate) starts: &'a [Pose<World, Vehicle>],
    /// Scales shared by the measurements.
    pub(crate) scales: Option<TrackScales>,
}

/// All edges of a vehicle.
pub(crate) fn of_vehicle(
    vehicle: &VehicleTrajectory,
    track: &TrackNodes<'_>,
    context: &EdgeContext<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let options = context.options;
    let mut out = Vec::new();
    if options.camera_vehicle {
        match &track.scales {
            Some(scales) => out.extend(scaled_measurements(vehicle, track.nodes, scales, context)),
            None => out.extend(measurements(vehicle, track.nodes, context)?),
        }
    }
    if let Some(scales) = &track.scales {
        out.extend(scales.priors(vehicle, context.scale_weight, options)?.into_iter().map(Edge::fixed));
    }
    if options.vehicle_vehicle && !is_static(vehicle, options) {
        out.extend(if options.constant_weights {
            road_plane_steps(vehicle, track.nodes, context)?
        } else {
            motion_model(vehicle, track.nodes, context)
        });
    }
    out.extend(ties(vehicle, track, context)?);
    Ok(out)
}

/// Camera–vehicle edges that share scales: one for each source of each frame.
fn scaled_measurements(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    scales: &TrackScales,
    context: &EdgeContext<'_>,
) -> Vec<Edge> {
    let of_state = |(state, node): (&VehicleState, &VariableId)| {
        let (camera, node, frame) = (context.cameras[state.frame], *node, state.frame);
        let inflation = inflation(vehicle, state, context);
        let edge = move |observation: &PoseObservation| {
            let information = inverse(&(observation.covariance * inflation));
            let (scale, at) = scales.of(observation, vehicle);
            let factor = ScaledPoseFactor::new([camera, node, scale], observation, at, information);
            let factor = match scales.common(observation) {
                Some(common) => factor.with_common(common, observation),
                None => factor,
            };
            Edge::classed(factor, EdgeClass::of(observation.source), frame, context)
        };
        state.observations.iter().map(edge).collect::<Vec<_>>()
    };
    vehicle.states.iter().zip(nodes).flat_map(of_state).collect()
}

/// Camera–vehicle edges without a common scale: one for each frame (eqs. 9–14).
fn measurements(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    context: &EdgeContext<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let edge = |(state, node): (&VehicleState, &VariableId)| {
        let inflation = inflation(vehicle, state, context);
        let camera = context.cameras[state.frame];
        state.measurement.as_ref().map(|m| measurement(m, [camera, *node], inflation, state.frame, context))
    };
    vehicle.states.iter().zip(nodes).filter_map(edge).collect()
}

/// Factor on the variances of a camera–vehicle edge: errors of neighbouring frames are correlated.
fn inflation(vehicle: &VehicleTrajectory, state: &VehicleState, context: &EdgeContext<'_>) -> f64 {
    let correlated = context.options.inflation(context.times.interval(state.frame));
    // All measurements of a pass by a static vehicle share their errors of slope, and of size where that is no variable. Another pass,
    // after frames without a state, has errors of its own.
    let seen = || {
        let passes = vehicle.states.chunk_by(|a, b| a.frame + 1 == b.frame);
        let own = passes.into_iter().find(|pass| pass.last().is_some_and(|s| s.frame >= state.frame));
        own.map_or(0, |pass| pass.iter().filter(|s| s.measurement.is_some()).count()) as f64
    };
    if is_static(vehicle, context.options) { correlated.max(seen()) } else { correlated }
}

fn measurement(
    fused: &VehicleMeasurement,
    [camera, vehicle]: [VariableId; 2],
    inflation: f64,
    frame: usize,
    context: &EdgeContext<'_>,
) -> Result<Edge, GraphError> {
    let (options, pose) = (context.options, *fused.camera_from_vehicle.isometry());
    if options.constant_weights {
        let near = pose.translation.vector.z <= options.advanced.near_limit_m;
        let lambda = if near { options.lambda_trusted } else { options.lambda_doubted };
        return Ok(Edge::fixed(Between::new(camera, vehicle, pose, weighted(lambda))?)); // (15)
    }
    let edge = Between::new(camera, vehicle, pose, inverse(&(fused.covariance * inflation)))?;
    Ok(Edge::classed(edge, EdgeClass::Box, frame, context))
}

/// Weak ties of the vehicle nodes to their cameras at the starting values, so that no choice of edges leaves a node
/// undetermined.
fn ties(
    vehicle: &VehicleTrajectory,
    track: &TrackNodes<'_>,
    context: &EdgeContext<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let advanced = &context.options.advanced;
    let [turn, place] = [advanced.tie_rad, advanced.tie_m].map(|sigma| 1.0 / (sigma * sigma));
    let weak = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, place, place, place));
    let mut out: Vec<Edge> = Vec::new();
    for (k, ((state, node), start)) in vehicle.states.iter().zip(track.nodes).zip(track.starts).enumerate() {
        if k > 0 && track.nodes[k - 1] == *node {
            continue;
        }
        let pose = context.ego.frames[state.frame].world_from_camera.inverse() * *start;
        out.push(Edge::fixed(Between::new(context.cameras[state.frame], *node, *pose.isometry(), weak)?));
    }
    Ok(out)
}
