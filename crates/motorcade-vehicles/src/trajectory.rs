//! One vehicle's way through the world, from the boxes of its track.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle, World};
use motorcade_perception::{BoundingBox, VehicleClass};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3};

use crate::ground::GroundFrame;
use crate::motion::{Moving, Place, probability_moving, smooth_motion, standing_place};
use crate::silhouette::{image_box, standing_pose};
use crate::single_view::{SingleView, locate};
use crate::size::size_prior;
use crate::tracker::Track;
use motorcade_shape::{Dimensions, SizePrior};

/// Which side of the road traffic keeps to; decides only which way a parked vehicle is taken to face, which its box
/// cannot tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrafficSide {
    /// Most of the world.
    #[default]
    Right,
    /// Britain, Japan, India, Australia, southern Africa.
    Left,
}

/// Where a state comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A box of this frame.
    Box,
    /// Keypoints of this frame, with its box.
    Keypoints,
    /// A pose given for this frame, with its box when there is one.
    Given,
    /// The motion model, between boxes.
    Predicted,
}

/// A vehicle in one frame.
#[derive(Clone, Debug)]
pub struct VehicleState {
    /// Frame (row of the run).
    pub frame: usize,
    /// Pose \[m\].
    pub world_from_vehicle: Pose<World, Vehicle>,
    /// Covariance (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
    /// Image box: the detection's, else the projected one \[px\].
    pub bbox: Option<BoundingBox>,
    /// Score of the detection; 0 when predicted.
    pub score: f64,
    /// Speed over the road, forward positive \[m/s\].
    pub speed_mps: f64,
    /// Standard deviation of the speed \[m/s\].
    pub speed_sigma_mps: f64,
    /// Yaw rate, left positive \[rad/s\].
    pub yaw_rate_radps: f64,
    /// Where the state comes from.
    pub source: Source,
    /// What this frame's box alone says, given the track's size and heading.
    pub measured: Option<Measured>,
}

/// A single frame's view of a vehicle, before any smoothing.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Pose in the camera \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
}

/// A vehicle and its way.
#[derive(Clone, Debug)]
pub struct VehicleTrajectory {
    /// Identity.
    pub id: usize,
    /// Class.
    pub class: VehicleClass,
    /// Size, one for the whole track.
    pub size: Dimensions,
    /// Standard deviation of the size.
    pub size_sigma: Dimensions,
    /// Probability that it moves at some time of the track.
    pub p_moving: f64,
    /// States, one a frame from the first box to the last.
    pub states: Vec<VehicleState>,
}

/// A vehicle that is slower holds its heading: direction of travel means nothing at a stand \[m/s\].
const HOLD_HEADING_MPS: f64 = 1.5;

/// A pose somebody else found in a frame (a shape-prior front end, say), in place of or beside the box.
#[derive(Clone, Copy, Debug)]
pub struct GivenView {
    /// Frame (row of the run).
    pub frame: usize,
    /// Bottom centre, camera frame \[m\].
    pub position_in_camera: Point3<f64>,
    /// Where the nose points, camera frame, unit.
    pub forward_in_camera: Vector3<f64>,
    /// Covariance of the position (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Whether it was given or comes from keypoints.
    pub source: Source,
}

/// All that one frame says of the place.
#[derive(Clone, Copy)]
struct View {
    frame: usize,
    position_in_camera: Point3<f64>,
    covariance: Matrix3<f64>,
}

struct Views {
    /// In order of frames.
    views: Vec<View>,
    size: Dimensions,
    size_sigma: Dimensions,
}

/// Estimates a track from its boxes and from poses given for it (either may be empty). `None` when nothing of it can be
/// placed on the road.
pub fn estimate_track(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    given: &[GivenView],
    side: TrafficSide,
) -> Option<VehicleTrajectory> {
    let frames = || track.boxes.iter().map(|b| b.frame).chain(given.iter().map(|g| g.frame));
    let (start, end) = (frames().min()?, frames().max()?);
    let times: Vec<f64> = grounds.get(start..=end)?.iter().map(|g| g.time_s).collect();
    let prior = size_prior(track.class);
    // The direction given, or the road's, to begin with; then the vehicle's own.
    let pointed = given_headings(grounds, given, start, times.len());
    let mut headings = pointed.clone().unwrap_or_else(|| vec![0.0; times.len()]);
    // Which way it stands is sought once: the boxes tell it, not where the vehicle was thought to be.
    let (mut estimate, mut parked) = (None, None);
    for _ in 0..3 {
        let views = view_all(camera, grounds, track, given, start, &headings, &prior)?;
        let places = places_of(&views.views, grounds);
        let up = grounds[start].world_from_camera.transform_vector(&grounds[start].up);
        let p_moving = probability_moving(&places);
        let states = if p_moving > 0.5 {
            smooth_motion(&places, &times, &up)
        } else {
            standing_states(&places, times.len())?
        };
        let before = std::mem::take(&mut headings);
        headings = if p_moving > 0.5 {
            headings_of_travel(&states, &grounds[start..=end], &before)
        } else if let Some(pointed) = &pointed {
            pointed.clone()
        } else {
            let seek = || standing_headings(camera, grounds, track, &prior, &states, start, side);
            parked.get_or_insert_with(seek).clone()
        };
        estimate = Some((views, states, p_moving));
        if headings == before {
            break;
        }
    }
    let (views, states, p_moving) = estimate?;
    let states = assemble(camera, grounds, track, given, start, &views, &states, &headings);
    Some(VehicleTrajectory {
        id: track.id,
        class: track.class,
        size: views.size,
        size_sigma: views.size_sigma,
        p_moving,
        states,
    })
}

/// Places every box with the given headings, joins what all boxes say of the size, and places them again with it.
fn view_all(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    given: &[GivenView],
    start: usize,
    headings: &[f64],
    prior: &SizePrior,
) -> Option<Views> {
    let place_all = |prior: &SizePrior| -> Vec<(usize, SingleView)> {
        let one = |b: &crate::tracker::TrackBox| {
            let heading = headings.get(b.frame - start)?;
            Some((b.frame, locate(camera, grounds.get(b.frame)?, &b.seen, *heading, prior)?))
        };
        track.boxes.iter().filter_map(one).collect()
    };
    let alone = place_all(prior);
    let (size, covariance) = joint_size(&alone, prior)?;
    let sigma = Vector3::from_fn(|k, _| covariance[(k, k)].max(0.0).sqrt().max(0.02));
    let (size, size_sigma) = (Dimensions::from_vector(&size), Dimensions::from_vector(&sigma));
    let boxes = place_all(&SizePrior { mean: size, sigma: size_sigma });
    let views = fuse(&boxes, given);
    (!views.is_empty()).then_some(Views { views, size, size_sigma })
}

/// One view a frame: what boxes and given poses say, weighted by their covariances.
fn fuse(boxes: &[(usize, SingleView)], given: &[GivenView]) -> Vec<View> {
    let mut all: Vec<View> = boxes
        .iter()
        .map(|(frame, v)| View {
            frame: *frame,
            position_in_camera: v.position_in_camera,
            covariance: v.covariance,
        })
        .collect();
    for g in given {
        let own = View { frame: g.frame, position_in_camera: g.position_in_camera, covariance: g.covariance };
        match all.iter_mut().find(|v| v.frame == g.frame) {
            Some(view) => {
                let informations = view.covariance.try_inverse().zip(g.covariance.try_inverse());
                let joint = informations.and_then(|(a, b)| Some((a, b, (a + b).try_inverse()?)));
                if let Some((a, b, covariance)) = joint {
                    let sum = a * view.position_in_camera.coords + b * g.position_in_camera.coords;
                    *view = View {
                        frame: g.frame,
                        position_in_camera: Point3::from(covariance * sum),
                        covariance,
                    };
                }
            }
            None => all.push(own),
        }
    }
    all.sort_by_key(|v| v.frame);
    all
}

/// Headings relative to each frame's camera from given poses, held between them; `None` when none are given.
fn given_headings(
    grounds: &[GroundFrame],
    given: &[GivenView],
    start: usize,
    count: usize,
) -> Option<Vec<f64>> {
    let world = |g: &GivenView| grounds[g.frame].world_from_camera.transform_vector(&g.forward_in_camera);
    let heading = |k: usize| {
        // The mean of the nine nearest in time: single-view headings scatter by degrees, and flip now and then. Flipped ones
        // are turned to the one that most others agree with.
        let mut near: Vec<&GivenView> = given.iter().collect();
        near.sort_by_key(|g| g.frame.abs_diff(start + k));
        near.truncate(9);
        let directions: Vec<Vector3<f64>> = near.iter().map(|g| world(g)).collect();
        let agreement = |d: &Vector3<f64>| directions.iter().map(|o| o.dot(d)).sum::<f64>();
        let medoid = directions.iter().max_by(|a, b| agreement(a).total_cmp(&agreement(b)))?;
        let sum: Vector3<f64> = directions.iter().map(|d| d * d.dot(medoid).signum()).sum();
        let ground = &grounds[start + k];
        Some(ground.heading_of(&ground.world_from_camera.inverse().transform_vector(&sum)))
    };
    (0..count).map(heading).collect()
}

/// The size all views agree on: each view's normal equations with its place eliminated (Schur complement), summed.
fn joint_size(views: &[(usize, SingleView)], prior: &SizePrior) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    /// Views count as at most this many independent ones: a detector draws the same car with the same habit every time.
    const INDEPENDENT: f64 = 12.0;
    let weight = (INDEPENDENT / views.len().max(1) as f64).min(1.0);
    let sigma = prior.sigma.to_vector();
    let mut h = Matrix3::from_diagonal(&sigma.map(|s| 1.0 / (s * s)));
    let mut rhs = h * prior.mean.to_vector();
    for (_, view) in views {
        let block = |r: usize, c: usize| view.information.fixed_view::<3, 3>(r, c).into_owned();
        let Some(inverse) = block(0, 0).try_inverse() else { continue };
        let eliminate = block(3, 0) * inverse;
        let reduced = block(3, 3) - eliminate * block(0, 3);
        let g = view.gradient.fixed_rows::<3>(3) - eliminate * view.gradient.fixed_rows::<3>(0);
        h += reduced * weight;
        rhs += (reduced * view.state.fixed_rows::<3>(3) - g) * weight;
    }
    let covariance = h.try_inverse()?;
    // Two and a half sigma of the class at most: a box cut by shadows does not make a two-metre car.
    let size = (covariance * rhs)
        .zip_zip_map(&prior.mean.to_vector(), &sigma, |v, m, s| v.clamp(m - 2.5 * s, m + 2.5 * s));
    Some((size, covariance))
}

fn places_of(views: &[View], grounds: &[GroundFrame]) -> Vec<Place> {
    let one = |view: &View| {
        let ground = &grounds[view.frame];
        let r = ground.world_from_camera.rotation_matrix();
        Place {
            frame: view.frame,
            time_s: ground.time_s,
            position: ground.world_from_camera.transform_point(&view.position_in_camera).coords,
            covariance: r * view.covariance * r.transpose(),
            range_m: view.position_in_camera.coords.norm(),
        }
    };
    views.iter().map(one).collect()
}

fn standing_states(places: &[Place], count: usize) -> Option<Vec<Moving>> {
    let (position, covariance) = standing_place(places)?;
    let mut full = Matrix6::zeros();
    full.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
    full.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * 0.05));
    Some(vec![Moving { position, velocity: Vector3::zeros(), covariance: full }; count])
}

/// Headings (relative to each frame's camera) from the direction of travel; held where the vehicle is slow.
fn headings_of_travel(states: &[Moving], grounds: &[GroundFrame], fallback: &[f64]) -> Vec<f64> {
    let directions: Vec<Option<Vector3<f64>>> = states
        .iter()
        .map(|s| (s.velocity.norm() > HOLD_HEADING_MPS).then(|| s.velocity.normalize()))
        .collect();
    let nearest = |k: usize| {
        let order =
            (0..directions.len()).filter(|i| directions[*i].is_some()).min_by_key(|i| i.abs_diff(k))?;
        directions[order]
    };
    let heading = |k: usize| match nearest(k) {
        Some(d) => grounds[k].heading_of(&grounds[k].world_from_camera.inverse().transform_vector(&d)),
        None => fallback[k],
    };
    (0..states.len()).map(heading).collect()
}

/// Heading of a standing vehicle: the one whose boxes fit best from all sides it was seen from.
fn standing_headings(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    prior: &SizePrior,
    states: &[Moving],
    start: usize,
    side: TrafficSide,
) -> Vec<f64> {
    const STEPS: usize = 12;
    const VIEWS: usize = 12;
    let every = track.boxes.len().div_ceil(VIEWS).max(1);
    let some: Vec<_> = track.boxes.iter().step_by(every).collect();
    let middle = &grounds[some[some.len() / 2].frame];
    let road = middle.world_from_camera.transform_vector(&middle.ahead());
    let local = |frame: usize, angle: f64| {
        // The same direction in the world, as this frame's camera sees it.
        let ground = &grounds[frame];
        let along = ground.world_from_camera.inverse().transform_vector(&road);
        ground.heading_of(&along) + angle
    };
    let misfit = |angle: f64| -> f64 {
        let one = |b: &&crate::tracker::TrackBox| {
            let view = locate(camera, &grounds[b.frame], &b.seen, local(b.frame, angle), prior)?;
            let size = view.size.to_vector() - prior.mean.to_vector();
            Some(view.chi2 + size.component_div(&prior.sigma.to_vector()).norm_squared())
        };
        // Most vehicles stand along the road.
        some.iter().map(|b| one(b).unwrap_or(30.0)).sum::<f64>() + 4.0 * angle.sin().powi(2)
    };
    let angles = (0..STEPS).map(|k| std::f64::consts::PI * k as f64 / STEPS as f64);
    let best = angles.map(|a| (misfit(a), a)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |b| b.1);
    let fold = if best > std::f64::consts::FRAC_PI_2 { best - std::f64::consts::PI } else { best };
    // Which end is the front the box does not tell: as traffic on its side of the road drives.
    let position = states.first().map_or(Vector3::zeros(), |s| s.position);
    let seen = middle.world_from_camera.inverse().transform_point(&Point3::from(position));
    let to_the_left = seen.coords.dot(&middle.left()) > 2.0;
    let to_the_right = seen.coords.dot(&middle.left()) < -2.0;
    let oncoming = match side {
        TrafficSide::Right => to_the_left,
        TrafficSide::Left => to_the_right,
    };
    let front = if oncoming { fold + std::f64::consts::PI } else { fold };
    (0..states.len()).map(|k| local(start + k, front)).collect()
}

#[expect(clippy::too_many_arguments, reason = "the parts of one vehicle, put together once")]
fn assemble(
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    track: &Track,
    given: &[GivenView],
    start: usize,
    views: &Views,
    states: &[Moving],
    headings: &[f64],
) -> Vec<VehicleState> {
    let mut out: Vec<VehicleState> = Vec::with_capacity(states.len());
    for (k, (state, heading)) in states.iter().zip(headings).enumerate() {
        let ground = &grounds[start + k];
        let camera_from_world = ground.world_from_camera.inverse();
        let position = camera_from_world.transform_point(&Point3::from(state.position));
        let forward = ground.direction_of(*heading);
        let camera_from_vehicle = standing_pose(&position, &forward, &ground.up);
        let world_from_vehicle = ground.world_from_camera * camera_from_vehicle;
        let found = track.boxes.iter().find(|b| b.frame == start + k);
        let direction = ground.world_from_camera.transform_vector(&forward);
        let speed_mps = state.velocity.dot(&direction);
        let velocity_covariance: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let speed_sigma_mps = direction.dot(&(velocity_covariance * direction)).max(0.0).sqrt();
        let (yaw_rate_radps, dt) = match out.last() {
            Some(before) => {
                let turn = before.world_from_vehicle.rotation().inverse() * world_from_vehicle.rotation();
                let dt = (ground.time_s - grounds[start + k - 1].time_s).max(1e-3);
                (turn.scaled_axis().z / dt, dt)
            }
            None => (0.0, 0.1),
        };
        out.push(VehicleState {
            frame: start + k,
            world_from_vehicle,
            covariance: pose_covariance(state, &world_from_vehicle, speed_mps, dt),
            bbox: match found {
                Some(b) => Some(b.seen.bbox),
                None => projected(camera, &camera_from_vehicle, track.class, &views.size),
            },
            score: found.map_or(0.0, |b| b.score),
            speed_mps,
            speed_sigma_mps,
            yaw_rate_radps,
            source: match (found, given.iter().find(|g| g.frame == start + k)) {
                (_, Some(given)) => given.source,
                (Some(_), None) => Source::Box,
                (None, None) => Source::Predicted,
            },
            measured: views
                .views
                .iter()
                .find(|v| v.frame == start + k)
                .map(|v| measured(v, ground, &forward)),
        });
    }
    out
}

fn measured(view: &View, ground: &GroundFrame, forward: &Vector3<f64>) -> Measured {
    /// A box tells heading badly; it comes from the way the vehicle goes, or from all its boxes together.
    const HEADING_SIGMA_RAD: f64 = 0.15;
    /// Upright on the road, whose cross-fall and crown are a degree or two.
    const TILT_SIGMA_RAD: f64 = 0.03;
    let camera_from_vehicle = standing_pose(&view.position_in_camera, forward, &ground.up);
    let r = camera_from_vehicle.rotation_matrix();
    let mut covariance = Matrix6::zeros();
    covariance[(0, 0)] = TILT_SIGMA_RAD * TILT_SIGMA_RAD;
    covariance[(1, 1)] = TILT_SIGMA_RAD * TILT_SIGMA_RAD;
    covariance[(2, 2)] = HEADING_SIGMA_RAD * HEADING_SIGMA_RAD;
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r.transpose() * view.covariance * r));
    Measured { camera_from_vehicle, covariance }
}

fn projected(
    camera: &PinholeCamera,
    pose: &Pose<Camera, Vehicle>,
    class: VehicleClass,
    size: &Dimensions,
) -> Option<BoundingBox> {
    let bbox = image_box(camera, pose, class, size)?.clipped(camera.width, camera.height);
    (bbox.width() > 1.0 && bbox.height() > 1.0).then_some(bbox)
}

fn pose_covariance(
    state: &Moving,
    world_from_vehicle: &Pose<World, Vehicle>,
    speed_mps: f64,
    dt: f64,
) -> Matrix6<f64> {
    let r = world_from_vehicle.rotation_matrix();
    let position: Matrix3<f64> = state.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let velocity: Matrix3<f64> = r.transpose() * state.covariance.fixed_view::<3, 3>(3, 3) * r;
    let mut out = Matrix6::zeros();
    // Upright within a degree or two; heading as sure as the direction of travel, at best 2°.
    let heading =
        (velocity[(1, 1)].max(0.0).sqrt() / speed_mps.abs().max(HOLD_HEADING_MPS)).max(2.0_f64.to_radians());
    out[(0, 0)] = 2.0_f64.to_radians().powi(2);
    out[(1, 1)] = 2.0_f64.to_radians().powi(2);
    out[(2, 2)] = heading.min(1.0).powi(2) + (0.01 * dt).powi(2);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r.transpose() * position * r));
    out
}
