//! Where the poses of a track start: a start that is turned round or placed wildly is not repaired by any kernel afterwards.

use motorcade_geometry::{Pose, Vehicle, World};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{Scaling, Sighting, Source, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Squared distances count up to this: χ² of 4 freedoms (place, heading) stays under it in 99 %.
const MOST: f64 = 13.3;
/// Candidates looked at, spread over the track: their number enters squared.
const CANDIDATES: usize = 48;
/// A way that is longer than this shows which way a vehicle drives \[m\].
const LEAST_WAY_M: f64 = 3.0;

/// Variances are taken larger by this, as in the graph: frames err alike.
const CORRELATED: f64 = 4.0;

/// A pose of the vehicle at the reference frame.
struct Candidate {
    pose: Pose<World, Vehicle>,
    place_variance: f64,
    /// `None` when it has no heading of its own.
    heading_variance: Option<f64>,
}

/// Starting poses of a vehicle, one a state.
///
/// With the front end's motion between states every sighting is carried to a frame in the middle; the medoid of these
/// candidates under a truncated metric, carried back, is the start. The front end's own pose is a candidate
/// too, without a vote.
pub(crate) fn starts(vehicle: &VehicleTrajectory, ego: &EgoTrajectory) -> Vec<Pose<World, Vehicle>> {
    let chain = unturned(vehicle);
    let Some(reference) = chain.get(chain.len() / 2).copied() else { return chain };
    let candidates = candidates(vehicle, ego, &chain, &reference);
    let own = Candidate { pose: reference, place_variance: 0.0, heading_variance: None };
    let has_heading = candidates.iter().any(|c| c.heading_variance.is_some());
    let may_win = |c: &&Candidate| !has_heading || c.heading_variance.is_some();
    // Nobody votes for itself: a stray would beat all that do not meet it exactly.
    let vote =
        |c: &Candidate, other: &Candidate| if std::ptr::eq(c, other) { MOST } else { distance(c, other) };
    let cost = |c: &Candidate| candidates.iter().map(|other| vote(c, other)).sum::<f64>();
    let all = std::iter::once(&own).chain(candidates.iter().filter(may_win));
    let best = all.map(|c| (cost(c), c.pose)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, medoid)) = best else { return chain };
    let carried = medoid * reference.inverse();
    chain.iter().map(|pose| carried * *pose).collect()
}

/// The front end's poses, none the other way round than the one before, and all as the vehicle drives.
fn unturned(vehicle: &VehicleTrajectory) -> Vec<Pose<World, Vehicle>> {
    let mut chain: Vec<Pose<World, Vehicle>> = Vec::with_capacity(vehicle.states.len());
    for state in &vehicle.states {
        let pose = state.world_from_vehicle;
        let against = chain.last().is_some_and(|before| nose(before).dot(&nose(&pose)) < 0.0);
        chain.push(if against { turned(&pose) } else { pose });
    }
    let ahead: f64 =
        chain.windows(2).map(|w| nose(&w[0]).dot(&(w[1].translation() - w[0].translation()))).sum();
    if ahead < -LEAST_WAY_M {
        chain.iter_mut().for_each(|pose| *pose = turned(pose));
    }
    chain
}

fn candidates(
    vehicle: &VehicleTrajectory,
    ego: &EgoTrajectory,
    chain: &[Pose<World, Vehicle>],
    reference: &Pose<World, Vehicle>,
) -> Vec<Candidate> {
    let seen =
        || vehicle.states.iter().zip(chain).flat_map(|(s, c)| s.sightings.iter().map(move |z| (s, c, z)));
    let every = seen().count().div_ceil(CANDIDATES).max(1);
    let one = |state: &VehicleState, pose: &Pose<World, Vehicle>, sighting: &Sighting| {
        let seen = ego.frames.get(state.frame)?.world_from_camera * sighting.camera_from_vehicle;
        // A box has the heading the front end gave it.
        let is_box = sighting.source == Source::Box;
        let there = if is_box { Pose::from_parts(pose.rotation(), seen.translation()) } else { seen };
        let place: Matrix3<f64> = sighting.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let slope = sighting.by_scale.fixed_rows::<3>(3);
        let variance = match sighting.scaling {
            Scaling::Size => vehicle.scale_variance(),
            Scaling::Source { sigma } => sigma * sigma,
        };
        let scale = slope * slope.transpose() * variance;
        Some(Candidate {
            pose: there * pose.inverse() * *reference,
            place_variance: CORRELATED * (place + scale).trace(),
            heading_variance: (!is_box).then_some(sighting.covariance[(2, 2)]),
        })
    };
    let of = |(state, pose, sighting)| one(state, pose, sighting);
    seen().step_by(every).filter_map(of).collect()
}

/// Squared distance in the voter's standard deviations, truncated: with its own, an uncertain candidate would be near to all.
fn distance(candidate: &Candidate, voter: &Candidate) -> f64 {
    let way = (candidate.pose.translation() - voter.pose.translation()).norm_squared();
    let place = 3.0 * way / voter.place_variance.max(1e-6);
    let turn = |variance: f64| {
        candidate.pose.rotation().angle_to(&voter.pose.rotation()).powi(2) / variance.max(1e-6)
    };
    (place + voter.heading_variance.map_or(0.0, turn)).min(MOST)
}

fn nose(pose: &Pose<World, Vehicle>) -> Vector3<f64> {
    pose.transform_vector(&Vector3::x())
}

/// The same place, facing the other way.
fn turned(pose: &Pose<World, Vehicle>) -> Pose<World, Vehicle> {
    let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    Pose::from_parts(pose.rotation() * half, pose.translation())
}
