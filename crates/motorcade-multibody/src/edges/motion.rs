//! Vehicle–vehicle edges.

use motorcade_graph::factors::Between;
use motorcade_graph::{GraphError, VariableId};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};

use super::edge::{Edge, EdgeContext, weighted};
use crate::classes::EdgeClass;
use crate::motion_factors::{NoSideSlip, SteadyMotion};

/// Vehicle–vehicle edges of the motion model: steady motion over three states, no side slip over two.
pub(super) fn motion_model(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    context: &EdgeContext<'_>,
) -> Vec<Edge> {
    let advanced = &context.options.advanced;
    let ([roll, pitch, yaw], [x, y, z]) = (advanced.steady_motion_rad, advanced.steady_motion_m);
    let steady_sigmas = [roll, pitch, yaw, x, y, z];
    let rear_axle_m = advanced.rear_axle_share * vehicle.size.length_m;
    let interval = |pair: &[VehicleState]| context.times.between(pair[0].frame, pair[1].frame);
    let mut out: Vec<Edge> = Vec::new();
    for (w, states) in nodes.windows(3).zip(vehicle.states.windows(3)) {
        let intervals_s = [interval(&states[..2]), interval(&states[1..])];
        let growth = steady_growth(intervals_s, advanced.reference_interval_s);
        let sigmas = steady_sigmas.map(|sigma| sigma * growth);
        let ratio = intervals_s[1] / intervals_s[0];
        let steady = SteadyMotion::new([w[0], w[1], w[2]], ratio, sigmas);
        out.push(Edge::classed(steady, EdgeClass::SteadyMotion, states[2].frame, context));
    }
    for (w, states) in nodes.windows(2).zip(vehicle.states.windows(2)) {
        // The motion of a slow vehicle does not show its heading.
        let slow = states[0].speed_mps.abs() <= advanced.slow_mps;
        let sideways = if slow { advanced.slow_sideways_slip_m } else { advanced.sideways_slip_m };
        let turn = advanced.roll_pitch_slip_rad;
        // White-noise velocity: variances grow with the interval.
        let growth = (interval(states) / advanced.reference_interval_s).sqrt();
        let sigmas = [turn, turn, sideways, advanced.vertical_slip_m].map(|sigma| sigma * growth);
        out.push(Edge::classed(
            NoSideSlip::new([w[0], w[1]], rear_axle_m, sigmas),
            EdgeClass::NoSideSlip,
            states[1].frame,
            context,
        ));
    }
    out
}

/// Growth of the standard deviation of a change of motion with the intervals. For white-noise acceleration of spectral density q
/// the velocity is a random walk, whose variance from the middle of one interval to that of the next is q (Δt₁ + Δt₂)/2. The
/// displacement over the second interval changes by Δt₂ times that: variance q Δt₂² (Δt₁ + Δt₂)/2, for equal intervals q Δt³.
fn steady_growth(intervals_s: [f64; 2], reference_s: f64) -> f64 {
    let [first, second] = intervals_s.map(|dt| dt / reference_s);
    second * (0.5 * (first + second)).sqrt()
}

/// The paper's vehicle–vehicle edges: differences of road-plane positions, registered by odometry (eqs. 1, 9–14).
pub(super) fn road_plane_steps(
    vehicle: &VehicleTrajectory,
    nodes: &[VariableId],
    context: &EdgeContext<'_>,
) -> Result<Vec<Edge>, GraphError> {
    let EdgeContext { ego, options, .. } = context;
    let place = |s: &VehicleState| {
        s.measurement.map(|m| (ego.frames[s.frame].world_from_camera * m.camera_from_vehicle, m))
    };
    let mut out: Vec<Edge> = Vec::new();
    for (w, pair) in nodes.windows(2).zip(vehicle.states.windows(2)) {
        let (Some((a, _)), Some((b, seen))) = (place(&pair[0]), place(&pair[1])) else { continue };
        let far = seen.camera_from_vehicle.translation().z > options.advanced.near_limit_m;
        let lambda = if far { options.lambda_trusted } else { options.lambda_doubted };
        let step = *(a.inverse() * b).isometry();
        out.push(Edge::fixed(Between::new(w[0], w[1], step, weighted(lambda))?)); // (15)
    }
    Ok(out)
}
