//! Starting poses of a track. No kernel repairs a start that is reversed or far off.

use motorcade_geometry::{Pose, Vehicle, World};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{PoseObservation, Scaling, Source, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::options::GraphOptions;
use crate::times::FrameTimes;

/// A pose of the vehicle at the reference frame.
struct Candidate {
    pose: Pose<World, Vehicle>,
    position_variance: f64,
    /// `None` for a measurement without a heading.
    heading_variance: Option<f64>,
}

/// Starting poses of a vehicle, one a state.
///
/// Every measurement is carried to a frame in the middle by the front end's motion between states; the medoid of these
/// candidates under a truncated metric, carried back, is the start. The front end's own pose is a candidate without a vote.
pub(crate) fn medoid_poses(
    vehicle: &VehicleTrajectory,
    ego: &EgoTrajectory,
    times: &FrameTimes<'_>,
    options: &GraphOptions,
) -> Vec<Pose<World, Vehicle>> {
    let truncation = options.advanced.start_truncation;
    let (chain, travels) = consistent_headings(vehicle, options.advanced.start_least_way_m);
    let Some(reference) = chain.get(chain.len() / 2).copied() else { return chain };
    let candidates = candidates(vehicle, (ego, times), (&chain, travels), &reference, options);
    let front_end = Candidate { pose: reference, position_variance: 0.0, heading_variance: None };
    let has_heading = candidates.iter().any(|c| c.heading_variance.is_some());
    let may_win = |c: &&Candidate| !has_heading || c.heading_variance.is_some();
    // No candidate votes for itself: an outlier would win over all that do not agree with each other exactly.
    let vote = |c: &Candidate, other: &Candidate| {
        if std::ptr::eq(c, other) { truncation } else { squared_distance(c, other).min(truncation) }
    };
    let cost = |c: &Candidate| candidates.iter().map(|other| vote(c, other)).sum::<f64>();
    let all = std::iter::once(&front_end).chain(candidates.iter().filter(may_win));
    let best = all.map(|c| (cost(c), c.pose)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, medoid)) = best else { return chain };
    let carried = medoid * reference.inverse();
    chain.iter().map(|pose| carried * *pose).collect()
}

/// The front end's poses with headings that agree with each other and with the direction of travel, and whether the way was long
/// enough to show that.
fn consistent_headings(vehicle: &VehicleTrajectory, least_way_m: f64) -> (Vec<Pose<World, Vehicle>>, bool) {
    let mut chain: Vec<Pose<World, Vehicle>> = Vec::with_capacity(vehicle.states.len());
    for state in &vehicle.states {
        let pose = state.world_from_vehicle;
        let against = chain.last().is_some_and(|before| forward(before).dot(&forward(&pose)) < 0.0);
        chain.push(if against { reversed(&pose) } else { pose });
    }
    let ahead: f64 =
        chain.windows(2).map(|w| forward(&w[0]).dot(&(w[1].translation() - w[0].translation()))).sum();
    if ahead < -least_way_m {
        chain.iter_mut().for_each(|pose| *pose = reversed(pose));
    }
    (chain, ahead.abs() > least_way_m)
}

fn candidates(
    vehicle: &VehicleTrajectory,
    (ego, times): (&EgoTrajectory, &FrameTimes<'_>),
    (chain, travels): (&[Pose<World, Vehicle>], bool),
    reference: &Pose<World, Vehicle>,
    options: &GraphOptions,
) -> Vec<Candidate> {
    let seen =
        || vehicle.states.iter().zip(chain).flat_map(|(s, c)| s.observations.iter().map(move |z| (s, c, z)));
    let every = seen().count().div_ceil(options.advanced.start_candidates.max(1)).max(1);
    let one = |state: &VehicleState, pose: &Pose<World, Vehicle>, observation: &PoseObservation| {
        let seen = ego.frames.get(state.frame)?.world_from_camera * observation.camera_from_vehicle;
        // A box has no heading of its own.
        let is_box = observation.source == Source::Box;
        // A reversed heading would turn the whole chain round.
        let against = travels && forward(&seen).dot(&forward(pose)) < 0.0;
        let there = match (is_box, against) {
            (true, _) => Pose::from_parts(pose.rotation(), seen.translation()),
            (false, true) => reversed(&seen),
            (false, false) => seen,
        };
        let place: Matrix3<f64> = observation.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let slope = observation.scale_derivative.fixed_rows::<3>(3);
        let variance = match observation.scaling {
            Scaling::Size => vehicle.scale_variance(),
            Scaling::Source { sigma } => sigma * sigma,
        };
        let scale = slope * slope.transpose() * variance;
        // As in the graph: errors of neighbouring frames are correlated.
        let inflation = options.inflation(times.interval(state.frame));
        Some(Candidate {
            pose: there * pose.inverse() * *reference,
            position_variance: inflation * (place + scale).trace(),
            heading_variance: (!is_box).then_some(observation.covariance[(2, 2)]),
        })
    };
    let of = |(state, pose, observation)| one(state, pose, observation);
    seen().step_by(every).filter_map(of).collect()
}

/// Squared distance in the voter's standard deviations: with its own, an uncertain candidate would be near to all.
fn squared_distance(candidate: &Candidate, voter: &Candidate) -> f64 {
    let way = (candidate.pose.translation() - voter.pose.translation()).norm_squared();
    let place = 3.0 * way / voter.position_variance.max(1e-6);
    let turn = |variance: f64| {
        candidate.pose.rotation().angle_to(&voter.pose.rotation()).powi(2) / variance.max(1e-6)
    };
    place + voter.heading_variance.map_or(0.0, turn)
}

fn forward(pose: &Pose<World, Vehicle>) -> Vector3<f64> {
    pose.transform_vector(&Vector3::x())
}

/// The same position, reversed heading.
fn reversed(pose: &Pose<World, Vehicle>) -> Pose<World, Vehicle> {
    let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    Pose::from_parts(pose.rotation() * half, pose.translation())
}

/// Starting poses of a vehicle, one for each state.
pub(crate) fn poses(
    vehicle: &VehicleTrajectory,
    ego: &EgoTrajectory,
    times: &FrameTimes<'_>,
    options: &GraphOptions,
) -> Vec<Pose<World, Vehicle>> {
    if options.advanced.medoid_start && !options.constant_weights {
        medoid_poses(vehicle, ego, times, options)
    } else {
        vehicle.states.iter().map(|s| s.world_from_vehicle).collect()
    }
}
