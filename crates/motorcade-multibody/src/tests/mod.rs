//! The graph on vehicles with known poses, sizes and noise.

use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_odometry::{EgoTrajectory, ExternalTrajectoryOptions, MetricOptions, OdometryTrajectory};
use motorcade_perception::VehicleClass;
use motorcade_testing::{CAMERA_HEIGHT_M, on_road};
use motorcade_vehicles::{Dimensions, PoseObservation, Scaling, Source, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::times::FrameTimes;
use crate::*;

mod rates;
mod rounding;

const FRAMES: usize = 80;
const SIZE: Dimensions = Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 };

/// The camera drives straight on, 1 m a frame.
fn camera(k: usize) -> Pose<World, Camera> {
    Pose::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, k as f64))
}

/// A car ahead in a long bend, as fast as the camera.
fn ahead(k: usize) -> Pose<World, Vehicle> {
    let (radius, angle) = (150.0, k as f64 / 150.0);
    on_road(-radius * (1.0 - angle.cos()), 18.0 + radius * angle.sin(), angle)
}

fn ego() -> EgoTrajectory {
    let poses: Vec<_> = (0..FRAMES).map(camera).collect();
    let timestamps_ns: Vec<i64> = (0..poses.len() as i64).map(|k| k * 100_000_000).collect();
    let odometry =
        OdometryTrajectory::from_poses(&poses, &timestamps_ns, &ExternalTrajectoryOptions::default());
    EgoTrajectory::metric(&odometry, &[], CAMERA_HEIGHT_M, 0.0, &MetricOptions::default())
}

/// A vehicle with the front end's poses `start` and the measurements `observations`.
fn vehicle(
    start: impl Fn(usize) -> Pose<World, Vehicle>,
    observations: impl Fn(usize) -> Vec<PoseObservation>,
    p_moving: f64,
) -> VehicleTrajectory {
    let state = |frame: usize| VehicleState {
        frame,
        world_from_vehicle: start(frame),
        covariance: Matrix6::identity(),
        bbox: None,
        score: 0.9,
        speed_mps: 10.0,
        speed_sigma_mps: 1.0,
        yaw_rate_radps: 0.0,
        source: Source::Box,
        measurement: None,
        observations: observations(frame),
        heading_variance: 0.0,
        rival: None,
    };
    VehicleTrajectory {
        id: 1,
        class: VehicleClass::Car,
        size: SIZE,
        size_covariance: Matrix3::from_diagonal(&Vector3::new(0.2, 0.01, 0.01)),
        size_by_road: None,
        p_moving,
        states: (0..FRAMES).map(state).collect(),
    }
}

/// A measurement: the truth, off by a tangent.
fn seen(source: Source, truth: &Pose<World, Vehicle>, frame: usize, off: &Vector6<f64>) -> PoseObservation {
    PoseObservation {
        source,
        camera_from_vehicle: (camera(frame).inverse() * *truth).retract(off),
        covariance: Matrix6::from_diagonal(&sigmas().map(|s| s * s)),
        scaling: Scaling::Size,
        scale_derivative: Vector6::zeros(),
        common_derivative: Vector6::zeros(),
    }
}

fn sigmas() -> Vector6<f64> {
    Vector6::new(0.02, 0.02, 0.08, 0.4, 0.15, 0.05)
}

/// Gaussian noise of [`sigmas`] a frame, the same for the same seed.
fn noise(seed: u64, factor: f64) -> Vec<Vector6<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    (0..FRAMES).map(|_| sigmas().map(|s| s * factor * normal())).collect()
}

/// Ten frames a second.
fn times_s() -> Vec<f64> {
    (0..FRAMES).map(|k| k as f64 * 0.1).collect()
}

fn solved(mut vehicle: VehicleTrajectory, options: &GraphOptions) -> (VehicleTrajectory, MultibodyGraph) {
    let graph = solve(&mut ego(), &mut vehicle, options);
    (vehicle, graph)
}

fn solve(ego: &mut EgoTrajectory, vehicle: &mut VehicleTrajectory, options: &GraphOptions) -> MultibodyGraph {
    let mut graph = MultibodyGraph::drive(options, 1).unwrap();
    let frames = WindowFrames { first: 0, times_s: &times_s() };
    graph.update(&frames, ego, std::slice::from_mut(vehicle)).unwrap();
    graph
}

/// Largest error of place \[m\] and heading \[rad\].
fn worst(vehicle: &VehicleTrajectory, truth: impl Fn(usize) -> Pose<World, Vehicle>) -> (f64, f64) {
    vehicle.states.iter().fold((0.0, 0.0), |(place, turn): (f64, f64), s| {
        let off = s.world_from_vehicle.inverse() * truth(s.frame);
        (place.max(off.translation().norm()), turn.max(off.rotation().angle()))
    })
}

fn half_turn() -> Vector6<f64> {
    Vector6::new(0.0, 0.0, std::f64::consts::PI, 0.0, 0.0, 0.0)
}

/// External poses, a quarter of them reversed and a tenth 25 m off.
fn external_with_outliers(frame: usize) -> Vec<PoseObservation> {
    let mut off = noise(3, 1.0)[frame];
    if frame % 4 == 1 {
        off += half_turn();
    }
    if frame % 10 == 7 {
        off[3] += 25.0;
    }
    vec![seen(Source::External, &ahead(frame), frame, &off)]
}

#[test]
fn a_reversed_or_distant_start_is_corrected() {
    // Two thirds of the front end's poses are reversed; all are; all lie 30 m too far, which the weak ties to them do not hold.
    type Start = fn(usize) -> Pose<World, Vehicle>;
    let starts: [(Start, bool); 3] = [
        (|k| if k % 3 == 0 { ahead(k) } else { ahead(k).retract(&half_turn()) }, true),
        (|k| ahead(k).retract(&half_turn()), true),
        (
            |k| Pose::<World, World>::from_parts(UnitQuaternion::identity(), Vector3::z() * 30.0) * ahead(k),
            false,
        ),
    ];
    for (k, (start, holds)) in starts.into_iter().enumerate() {
        let whole = GraphOptions::default();
        let (found, _) = solved(vehicle(start, external_with_outliers, 1.0), &whole);
        let (place_m, turn_rad) = worst(&found, ahead);
        assert!(place_m < 0.6 && turn_rad < 0.2, "start {k}: {place_m} m, {turn_rad} rad");
        // No kernel corrects the front end's poses.
        let mut left = whole;
        left.advanced.medoid_start = false;
        let (lost, _) = solved(vehicle(start, external_with_outliers, 1.0), &left);
        let (place_m, turn_rad) = worst(&lost, ahead);
        let is_lost = place_m > 1.0 || turn_rad > 1.0;
        assert_eq!(is_lost, holds, "start {k}: {place_m} m, {turn_rad} rad");
    }
}

#[test]
fn an_error_that_all_measurements_share_does_not_average_out() {
    // A car that is always 60 m ahead, measured with noise, and with an error of 5 % that all frames share.
    let far = |k: usize| on_road(0.0, 60.0 + camera(k).translation().z, 0.0);
    let views = |k: usize, shared_m: f64| {
        let observation = seen(Source::Box, &far(k), k, &noise(5, 1.0)[k]);
        // Along the view, in the axes of the vehicle as it was measured.
        let ahead_m = observation.camera_from_vehicle.rotation().inverse() * Vector3::z();
        let tangent = |m: f64| Vector6::new(0.0, 0.0, 0.0, m * ahead_m.x, m * ahead_m.y, m * ahead_m.z);
        vec![PoseObservation {
            common_derivative: tangent(-shared_m),
            scale_derivative: tangent(60.0),
            ..observation
        }]
    };
    let known_size =
        |v: VehicleTrajectory| VehicleTrajectory { size_covariance: Matrix3::identity() * 1e-6, ..v };
    let solve = |shared_m: f64| {
        solved(known_size(vehicle(far, |k| views(k, shared_m), 1.0)), &GraphOptions::default()).0
    };
    let (alone, shared) = (solve(0.0), solve(3.0));
    let middle = FRAMES / 2;
    let sigma = |v: &VehicleTrajectory| v.states[middle].covariance[(3, 3)].sqrt();
    assert!(
        sigma(&alone) < 0.6 && (2.9..3.2).contains(&sigma(&shared)),
        "{} {}",
        sigma(&alone),
        sigma(&shared)
    );
    // The estimate itself does not take the error for known.
    let place = |v: &VehicleTrajectory| v.states[middle].world_from_vehicle.translation();
    assert!((place(&alone) - place(&shared)).norm() < 0.02, "{} {}", place(&alone), place(&shared));
}

/// A network takes the back for the front: the chain of poses keeps its direction of travel.
#[test]
fn reversed_headings_of_all_views_do_not_turn_the_way_round() {
    let views = |k: usize| vec![seen(Source::External, &ahead(k), k, &(noise(7, 1.0)[k] + half_turn()))];
    let vehicle = vehicle(ahead, views, 1.0);
    let starts = start::poses(&vehicle, &ego(), &FrameTimes::new(&times_s(), 0.1), &GraphOptions::default());
    let far = |k: usize| (starts[k].translation() - ahead(k).translation()).norm();
    assert!(far(0) < 5.0 && far(FRAMES - 1) < 5.0, "{} m {} m", far(0), far(FRAMES - 1));
}

#[test]
fn a_start_that_is_right_stays() {
    let observations = |k: usize| vec![seen(Source::Box, &ahead(k), k, &noise(5, 1.0)[k])];
    let vehicle = vehicle(ahead, observations, 1.0);
    let starts = start::poses(&vehicle, &ego(), &FrameTimes::new(&times_s(), 0.1), &GraphOptions::default());
    for (k, start) in starts.iter().enumerate() {
        assert!((start.inverse() * ahead(k)).log().norm() < 1e-9, "frame {k}");
    }
}

#[test]
fn covariances_that_are_too_small_are_made_larger() {
    let options = GraphOptions { correlation_time_s: 0.1, ..GraphOptions::default() };
    for true_factor in [4.0_f64, 1.0, 0.25] {
        let noise = noise(11, true_factor.sqrt());
        let observations = |k: usize| vec![seen(Source::External, &ahead(k), k, &noise[k])];
        let (_, graph) = solved(vehicle(ahead, observations, 1.0), &options);
        let found = graph.variance_factors().iter().find(|f| f.class == EdgeClass::External).unwrap();
        let ratio = found.found / true_factor;
        assert!((0.65..1.5).contains(&ratio), "{true_factor}: {found:?}");
        // Factors below 1 are not used: residuals do not show errors that last.
        assert_eq!(found.factor, found.found.max(1.0));
        assert!(found.edges == FRAMES && found.degrees_of_freedom > 80.0, "{found:?}");
    }
}

#[test]
fn few_residuals_leave_covariances_as_they_are() {
    let options = GraphOptions { correlation_time_s: 0.1, ..GraphOptions::default() };
    let noise = noise(11, 3.0);
    let observations = |k: usize| {
        if k.is_multiple_of(10) { vec![seen(Source::External, &ahead(k), k, &noise[k])] } else { vec![] }
    };
    let (_, graph) = solved(vehicle(ahead, observations, 1.0), &options);
    let found = graph.variance_factors().iter().find(|f| f.class == EdgeClass::External).unwrap();
    assert!(found.degrees_of_freedom < 30.0 && found.factor == 1.0, "{found:?}");
}

#[test]
fn a_parked_car_seen_from_many_distances_has_its_size_estimated() {
    // 8 % larger than thought: each view puts it the nearer the further away it is seen from.
    let (truth, larger) = (on_road(4.0, 95.0, 0.0), 0.08);
    // Depth over height of the car, as boxes have it.
    let slope = |frame: usize| {
        let place = (camera(frame).inverse() * truth).translation();
        let ray = truth.inverse().transform_vector(&camera(frame).transform_vector(&place));
        Vector6::new(0.0, 0.0, 0.0, ray.x, ray.y, ray.z)
    };
    let noise = noise(7, 0.3);
    let observations = |k: usize| {
        let scale_derivative = slope(k);
        vec![PoseObservation {
            scale_derivative,
            ..seen(Source::Box, &truth, k, &(noise[k] - scale_derivative * larger))
        }]
    };
    let standing = || vehicle(|_| truth, observations, 0.01);
    let before = standing().scale_variance().sqrt();
    let (found, _) = solved(standing(), &GraphOptions::default());
    let (off, sigma) = ((found.size.height_m / SIZE.height_m).ln() - larger, found.scale_variance().sqrt());
    assert!(off.abs() < 0.02 && off.abs() < 3.0 * sigma, "{off}, sigma {sigma}");
    assert!(sigma < 0.5 * before, "{sigma} after {before}");
    // Proportions are kept.
    assert!((found.size.length_m / found.size.height_m - SIZE.length_m / SIZE.height_m).abs() < 1e-9);
    let (place_m, _) = worst(&found, |_| truth);
    // Without a common scale the views agree on a place that is too near for all of them.
    let mut apart = GraphOptions::default();
    apart.advanced.shared_size = false;
    let (blind, _) = solved(standing(), &apart);
    assert!(place_m < 0.8 && (blind.size.height_m - SIZE.height_m).abs() < 1e-9, "{place_m} m");
}

/// Poses from elsewhere put a car 12 % too far in every frame, boxes where it is.
#[test]
fn a_common_error_of_external_distances_is_a_scale() {
    let noises = [noise(17, 1.0), noise(19, 1.0)];
    let too_far_m = |common: bool| {
        let observations = |k: usize| {
            let away = -(ahead(k).inverse() * camera(k)).translation();
            let by_distance = Vector6::new(0.0, 0.0, 0.0, away.x, away.y, away.z);
            let given = seen(Source::External, &ahead(k), k, &(noises[0][k] + by_distance * 0.12));
            let scaling = if common { Scaling::Source { sigma: 0.06 } } else { Scaling::Size };
            let scale_derivative = if common { by_distance } else { Vector6::zeros() };
            vec![
                seen(Source::Box, &ahead(k), k, &noises[1][k]),
                PoseObservation { scaling, scale_derivative, ..given },
            ]
        };
        let (found, _) = solved(vehicle(ahead, observations, 1.0), &GraphOptions::default());
        let range =
            |pose: &Pose<World, Vehicle>, k: usize| (camera(k).inverse() * *pose).translation().norm();
        let off = |s: &VehicleState| range(&s.world_from_vehicle, s.frame) - range(&ahead(s.frame), s.frame);
        found.states.iter().map(off).sum::<f64>() / FRAMES as f64
    };
    let [common, separate] = [true, false].map(too_far_m);
    println!("too far by {common:.2} m with a common factor, {separate:.2} m without");
    assert!(separate > 0.2 && common.abs() < 0.6 * separate, "{common} {separate}");
}

/// After a tenth of a second without measurements the camera trajectory continues half a metre aside; a static car, seen before and
/// after, corrects it. Measured steps keep their lengths, by default also their directions.
#[test]
fn a_static_car_is_a_landmark_across_a_break() {
    const BREAK: usize = 40;
    let truth = on_road(4.0, 95.0, 0.0);
    let noise = noise(13, 0.3);
    let observations = |k: usize| vec![seen(Source::Box, &truth, k, &noise[k])];
    let mut broken = ego();
    let aside = Pose::<World, World>::from_parts(UnitQuaternion::identity(), Vector3::x() * 0.5);
    for frame in &mut broken.frames[BREAK..] {
        frame.world_from_camera = aside * frame.world_from_camera;
    }
    broken.frames[BREAK].step_measured = false;
    let aside = Vector6::new(0.0, 0.0, 0.0, 0.5, 0.5, 0.5);
    broken.frames[BREAK].step_covariance += Matrix6::from_diagonal(&aside.map(|s| s * s));
    let off = |coupling: CameraCoupling| {
        let (mut ego, mut vehicle) = (broken.clone(), vehicle(|_| truth, observations, 0.01));
        let options = GraphOptions { camera: coupling, ..GraphOptions::default() };
        solve(&mut ego, &mut vehicle, &options);
        let place = |k: usize| ego.frames[k].world_from_camera.translation();
        for k in (1..FRAMES).filter(|k| *k != BREAK) {
            assert!(((place(k) - place(k - 1)).norm() - 1.0).abs() < 1e-6, "step {k}");
        }
        (place(BREAK + 5) - camera(BREAK + 5).translation()).norm()
    };
    let [held, steps, bent] =
        [CameraCoupling::Held, CameraCoupling::StepsHeld, CameraCoupling::LengthsHeld].map(off);
    println!("off after the break [m]: held {held}, steps held {steps}, lengths held {bent}");
    assert!((held - 0.5).abs() < 1e-9 && steps < 0.2 && bent < 0.2, "{held} {steps} {bent}");
}

/// Measurements of a parked car are off along the ray (large sigma) and across it (small sigma), the more the further away. The
/// heading, on which all agree, must not compensate.
#[test]
fn measurements_that_disagree_on_the_position_do_not_turn_a_parked_car() {
    let truth = on_road(4.0, 95.0, 0.0);
    let observations = |k: usize| {
        let share = 1.0 - k as f64 / FRAMES as f64;
        vec![seen(Source::Box, &truth, k, &(Vector6::new(0.0, 0.0, 0.0, 3.0, 0.5, 0.0) * share))]
    };
    let (found, _) = solved(vehicle(|_| truth, observations, 0.01), &GraphOptions::default());
    let (place_m, turn_rad) = worst(&found, |_| truth);
    assert!(turn_rad < 1e-3 && place_m < 3.0, "{turn_rad} rad, {place_m} m");
}

/// The front end's speed of a vehicle that is seen for a moment is that of positions that scatter along the line of sight.
#[test]
fn speeds_are_those_of_the_poses() {
    let noise = noise(5, 1.0);
    let mut start = vehicle(ahead, |k| vec![seen(Source::Box, &ahead(k), k, &noise[k])], 1.0);
    start.states.iter_mut().for_each(|s| s.speed_mps = 31.0);
    let (found, _) = solved(start, &GraphOptions::default());
    let truth_mps = (ahead(1).translation() - ahead(0).translation()).norm() / 0.1;
    let errors: Vec<f64> = found.states.iter().map(|s| (s.speed_mps - truth_mps).abs()).collect();
    assert!(errors.iter().all(|error| *error < 1.5), "{truth_mps}: {errors:?}");
    for k in 1..found.states.len() - 1 {
        let at = |k: usize| found.states[k].world_from_vehicle.translation();
        let way_m = (at(k + 1) - at(k - 1)).norm();
        assert!((found.states[k].speed_mps - way_m / 0.2).abs() < 0.05, "{k}");
    }
}
