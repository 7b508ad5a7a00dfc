//! The edges of the multi-object graph, for the whole drive or a window of it.

use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_graph::factors::Between;
use motorcade_graph::{Factor, GraphError, Robust, VariableId};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_vehicles::{Sighting, VehicleMeasurement, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix6, Vector3, Vector6};

use super::classes::{ClassScales, EdgeClass};
use super::motion_factors::{NoSideSlip, SteadyMotion};
use super::sized_sighting::ScaledPoseFactor;
use super::track_scales::TrackScales;
use super::{CameraCoupling, GraphOptions};

/// An edge, not yet in a graph.
pub(crate) struct Edge {
    /// What it counts for when covariances are re-estimated; `None` for what only holds a node.
    pub(crate) class: Option<EdgeClass>,
    pub(crate) factor: Box<dyn Factor>,
}

impl Edge {
    /// Whose covariance is taken as it is.
    fn fixed(factor: impl Factor + 'static) -> Self {
        Self { class: None, factor: Box::new(factor) }
    }
    /// Under the kernel of its class, at the class' factor.
    fn classed(factor: impl Factor + 'static, class: EdgeClass, build: &Build<'_>) -> Self {
        let kernel = build.scales.kernel(class, build.options);
        Self { class: Some(class), factor: Box::new(Robust::new(factor, kernel)) }
    }
}

/// What all edges of a graph are made with.
#[derive(Clone, Copy)]
pub(crate) struct Build<'a> {
    pub(crate) ego: &'a EgoTrajectory,
    /// `cameras[k]` is the node of frame k of `ego`.
    pub(crate) cameras: &'a [VariableId],
    pub(crate) options: &'a GraphOptions,
    pub(crate) scales: &'a ClassScales,
}

/// The nodes of a vehicle.
#[derive(Clone, Copy)]
pub(crate) struct Own<'a> {
    /// One a state.
    pub(crate) nodes: &'a [VariableId],
    /// Where they start.
    pub(crate) starts: &'a [Pose<World, Vehicle>],
    /// Its scales, when views share them.
    pub(crate) scales: Option<TrackScales>,
}

/// A vehicle that moves with less probability is one node.
const STANDING: f64 = 0.5;

/// The rear axle lies this share of the length behind the middle, on cars, vans, lorries and buses alike.
const REAR_AXLE: f64 = 0.3;

/// True for a vehicle that is one node, seen from many cameras.
pub(crate) fn stands(vehicle: &VehicleTrajectory, options: &GraphOptions) -> bool {
    vehicle.p_moving < STANDING && !options.constant_weights
}

/// True when all views of a vehicle share one variable for the scale of its size.
pub(crate) fn shares_size(options: &GraphOptions) -> bool {
    options.shared_size && !options.constant_weights
}

/// Camera–camera edges: odometry.
pub(crate) fn of_cameras(build: &Build<'_>) -> Result<Vec<Edge>, GraphError> {
    let Build { ego, cameras, options, .. } = build;
    if !options.camera_camera {
        return Ok(Vec::new());
    }
    let one = |(nodes, frames): (&[VariableId], &[EgoFrame])| -> Result<Edge, GraphError> {
        let step = frames[0].world_from_camera.inverse() * frames[1].world_from_camera;
        let information = if options.constant_weights {
            Matrix6::identity() * options.lambda_camera
        } else {
            step_information(&frames[1], &step, options)
        };
        let edge = Between::new(nodes[0], nodes[1], *step.isometry(), information)?;
        Ok(if options.constant_weights {
            Edge::fixed(edge)
        } else {
            Edge::classed(edge, EdgeClass::Odometry, build)
        })
    };
    cameras.windows(2).zip(ego.frames.windows(2)).map(one).collect()
}

/// True for a step of the camera that no vehicle may change.
pub(crate) fn step_is_held(frame: &EgoFrame, options: &GraphOptions) -> bool {
    match options.camera {
        CameraCoupling::Held => true,
        CameraCoupling::StepsHeld => options.camera_camera && frame.step_measured && metric(frame),
        CameraCoupling::LengthsHeld | CameraCoupling::Free => false,
    }
}

/// A scale that is less certain was guessed rather than measured.
fn metric(frame: &EgoFrame) -> bool {
    const GUESSED: f64 = 0.2;
    frame.scale_sigma < GUESSED
}

/// Information of a step of the camera.
fn step_information(frame: &EgoFrame, step: &Pose<Camera, Camera>, options: &GraphOptions) -> Matrix6<f64> {
    /// Frames are placed against the same landmarks: what one errs the next takes back, and over a second and more the variance
    /// of the way is a fifth of the sum of its steps' (ten rendered drives, 30 to 119 frames; rotation and sideways).
    const STEP_ANTICORRELATION: f64 = 5.0;
    /// What a step that is held may turn by \[rad\], and be off by \[m\]: a hundred of them a tenth of a milliradian, a millimetre.
    const HELD_RAD: f64 = 1e-5;
    const HELD_M: f64 = 1e-4;
    let information = inverse(&frame.step_covariance);
    if !frame.step_measured {
        return information;
    }
    let along = step.rotation_matrix().transpose() * step.translation();
    let d = along.try_normalize(1e-3).unwrap_or_else(Vector3::zeros);
    let d = Vector6::new(0.0, 0.0, 0.0, d.x, d.y, d.z);
    // Errors of scale last: of the length nothing is taken back.
    let across = Matrix6::identity() - d * d.transpose();
    let taken = Matrix6::identity() + across * (STEP_ANTICORRELATION.sqrt() - 1.0);
    let [turn, place] = [HELD_RAD, HELD_M].map(|sigma| 1.0 / (sigma * sigma));
    let whole = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, place, place, place));
    let held = match options.camera {
        CameraCoupling::StepsHeld if metric(frame) => whole,
        CameraCoupling::StepsHeld => across * whole * across,
        CameraCoupling::LengthsHeld if metric(frame) => d * d.transpose() * place,
        CameraCoupling::LengthsHeld | CameraCoupling::Held | CameraCoupling::Free => Matrix6::zeros(),
    };
    taken * information * taken + held
}

/// All edges of a vehicle.
pub(crate) fn of_vehicle(
    vehicle: &VehicleTrajectory,
    own: &Own<'_>,
    build: &Build<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let options = build.options;
    let mut out = Vec::new();
    if options.camera_vehicle {
        match &own.scales {
            Some(scales) => {
                let sized = sized_sightings(vehicle, own.nodes, scales, build);
                out.extend(sized.into_iter().map(|(class, s)| Edge::classed(s, class, build)));
            }
            None => out.extend(views(vehicle, own.nodes, build)?),
        }
    }
    if let Some(scales) = &own.scales {
        out.extend(scales.priors(vehicle, options)?.into_iter().map(Edge::fixed));
    }
    if options.vehicle_vehicle && !stands(vehicle, options) {
        out.extend(if options.constant_weights {
            road_plane_steps(vehicle, own.nodes, build)?
        } else {
            motion(vehicle, own.nodes, build)
        });
    }
    out.extend(ties(vehicle, own, build)?);
    Ok(out)
}

/// Camera–vehicle edges that share scales: what each source of each frame says, its scale held.
pub(crate) fn sized_sightings(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    scales: &TrackScales,
    build: &Build<'_>,
) -> Vec<(EdgeClass, ScaledPoseFactor)> {
    let share = correlated_frames(vehicle, build.options);
    let of_state = |(state, node): (&VehicleState, &VariableId)| {
        let (camera, node) = (build.cameras[state.frame], *node);
        let one = move |sighting: &Sighting| {
            let information = inverse(&(sighting.covariance * share));
            let (scale, at) = scales.of(sighting, vehicle);
            let factor = ScaledPoseFactor::new([camera, node, scale], sighting, at, information);
            (EdgeClass::of(sighting.source), factor)
        };
        state.sightings.iter().map(one).collect::<Vec<_>>()
    };
    vehicle.states.iter().zip(nodes).flat_map(of_state).collect()
}

/// Camera–vehicle edges without a common size: what each frame says of the vehicle.
fn views(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    build: &Build<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let share = correlated_frames(vehicle, build.options);
    let one = |(state, node): (&VehicleState, &VariableId)| {
        state.measured.as_ref().map(|m| view(m, build.cameras[state.frame], *node, share, build))
    };
    vehicle.states.iter().zip(nodes).filter_map(one).collect()
}

/// What the variance of a camera–vehicle edge is multiplied by: frames err alike.
fn correlated_frames(vehicle: &VehicleTrajectory, options: &GraphOptions) -> f64 {
    let seen = vehicle.states.iter().filter(|s| s.measured.is_some()).count();
    // All views of a standing vehicle share their errors of slope, and of size where that is no variable.
    if stands(vehicle, options) {
        options.correlated_frames.max(seen as f64)
    } else {
        options.correlated_frames
    }
}

fn view(
    measured: &VehicleMeasurement,
    camera: VariableId,
    vehicle: VariableId,
    share: f64,
    build: &Build<'_>,
) -> Result<Edge, GraphError> {
    let (options, pose) = (build.options, *measured.camera_from_vehicle.isometry());
    if options.constant_weights {
        let near = pose.translation.vector.z <= options.near_limit_m;
        let lambda = if near { options.lambda_trusted } else { options.lambda_doubted };
        return Ok(Edge::fixed(Between::new(camera, vehicle, pose, Matrix6::identity() * lambda)?));
    }
    let edge = Between::new(camera, vehicle, pose, inverse(&(measured.covariance * share)))?;
    Ok(Edge::classed(edge, EdgeClass::Box, build))
}

/// Vehicle–vehicle edges: steady motion, no side slip.
fn motion(vehicle: &VehicleTrajectory, nodes: &[VariableId], build: &Build<'_>) -> Vec<Edge> {
    // Per step of a tenth of a second: 0.03 rad of yaw (0.3 rad/s per s over 0.1 s), 1.5 m/s² along, 0.5 m/s² across.
    let sigmas = [0.01, 0.01, 0.004, 0.02, 0.01, 0.01];
    let information = Matrix6::from_diagonal(&Vector6::from_fn(|k, _| 1.0 / (sigmas[k] * sigmas[k])));
    let rear_axle_m = REAR_AXLE * vehicle.size.length_m;
    let mut out: Vec<Edge> = Vec::new();
    for w in nodes.windows(3) {
        let steady = SteadyMotion::new([w[0], w[1], w[2]], &information);
        out.push(Edge::classed(steady, EdgeClass::SteadyMotion, build));
    }
    for (w, state) in nodes.windows(2).zip(&vehicle.states) {
        // Standing still a vehicle's heading does not show in its motion; the factor then says nothing of it anyway.
        let sideways = if state.speed_mps.abs() > 1.0 { 0.02 } else { 0.05 };
        let rolling = NoSideSlip::new([w[0], w[1]], rear_axle_m, [0.01, 0.01, sideways, 0.03]);
        out.push(Edge::classed(rolling, EdgeClass::NoSideSlip, build));
    }
    out
}

/// The paper's vehicle–vehicle edges: differences of road-plane places, registered by odometry.
fn road_plane_steps(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    build: &Build<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let Build { ego, options, .. } = build;
    let place = |s: &VehicleState| {
        s.measured.map(|m| (ego.frames[s.frame].world_from_camera * m.camera_from_vehicle, m))
    };
    let mut out: Vec<Edge> = Vec::new();
    for (w, pair) in nodes.windows(2).zip(vehicle.states.windows(2)) {
        let (Some((a, _)), Some((b, seen))) = (place(&pair[0]), place(&pair[1])) else { continue };
        let far = seen.camera_from_vehicle.translation().z > options.near_limit_m;
        let lambda = if far { options.lambda_trusted } else { options.lambda_doubted };
        let step = *(a.inverse() * b).isometry();
        out.push(Edge::fixed(Between::new(w[0], w[1], step, Matrix6::identity() * lambda)?));
    }
    Ok(out)
}

/// A weak tie of every vehicle node to its camera where it starts, so that no choice of edges leaves a node free: ten
/// metres, one radian.
fn ties(vehicle: &VehicleTrajectory, own: &Own<'_>, build: &Build<'_>) -> Result<Vec<Edge>, GraphError> {
    let weak = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, 0.01, 0.01, 0.01));
    let mut out: Vec<Edge> = Vec::new();
    for (k, ((state, node), start)) in vehicle.states.iter().zip(own.nodes).zip(own.starts).enumerate() {
        if k > 0 && own.nodes[k - 1] == *node {
            continue;
        }
        let pose = build.ego.frames[state.frame].world_from_camera.inverse() * *start;
        out.push(Edge::fixed(Between::new(build.cameras[state.frame], *node, *pose.isometry(), weak)?));
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
