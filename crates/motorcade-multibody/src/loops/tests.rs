//! Loops of a square driven twice.

use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use motorcade_geometry::lie::se3::adjoint;
use motorcade_geometry::{Camera, Pose, World};
use motorcade_graph::{GraphError, Stop};
use motorcade_odometry::{EgoTrajectory, ExternalTrajectoryOptions, MetricOptions, OdometryTrajectory};
use nalgebra::{Matrix6, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{LoopEdge, LoopOptions, LoopReport, LoopSolve, MapEdge, PlaceEdges, close_loops};
use crate::edges::inverse;
use crate::options::GraphOptions;

const ROUND: usize = 160;

/// Two rounds of four sides of 40 m, a metre a frame; the last four metres of each turn by a quarter.
fn truth() -> Vec<Pose<World, Camera>> {
    let mut poses = vec![Pose::identity()];
    for k in 1..2 * ROUND {
        let yaw = if k % 40 >= 36 { std::f64::consts::FRAC_PI_2 / 4.0 } else { 0.0 };
        let last: Pose<World, Camera> = poses[k - 1];
        poses.push(last.retract(&Vector6::new(0.0, yaw, 0.0, 0.0, 0.0, 1.0)));
    }
    poses
}

/// The trajectory with drifting heading and scale.
fn drifted(truth: &[Pose<World, Camera>]) -> EgoTrajectory {
    let mut poses = vec![truth[0]];
    for k in 1..truth.len() {
        let step = truth[k - 1].inverse() * truth[k];
        let scale = 1.0 + 0.03 * (k as f64 / 90.0).sin();
        let turned = step.scaled(scale).retract(&Vector6::new(0.0, 3e-4, 0.0, 0.0, 0.0, 0.0));
        poses.push(poses[k - 1] * turned);
    }
    measured(&poses)
}

/// A trajectory with the usual covariances.
fn measured(poses: &[Pose<World, Camera>]) -> EgoTrajectory {
    let times: Vec<i64> = (0..poses.len() as i64).map(|k| k * 100_000_000).collect();
    EgoTrajectory::metric(
        &OdometryTrajectory::from_poses(poses, &times, &ExternalTrajectoryOptions::default()),
        &[],
        1.65,
        0.006,
        &MetricOptions::default(),
    )
}

fn edge(truth: &[Pose<World, Camera>], earlier: usize, later: usize, rng: &mut ChaCha8Rng) -> LoopEdge {
    let mut noise = |sigma: f64| rng.random_range(-1.7..1.7) * sigma;
    let error = Vector6::new(noise(1e-3), noise(1e-3), noise(1e-3), noise(0.02), noise(0.02), noise(0.03));
    let covariance = Matrix6::from_diagonal(&Vector6::new(1e-6, 1e-6, 1e-6, 4e-4, 4e-4, 9e-4));
    let later_from_earlier = (truth[later].inverse() * truth[earlier]).retract(&error);
    LoopEdge { earlier, later, later_from_earlier, covariance }
}

fn solve(graph: &GraphOptions, threads: usize) -> LoopSolve<'_> {
    LoopSolve { graph, interval_s: 0.1, threads, stop: Stop::NEVER }
}

fn close(ego: &mut EgoTrajectory, loops: &[LoopEdge], threads: usize) -> LoopReport {
    let edges = PlaceEdges { loops: loops.to_vec(), map: Vec::new() };
    close_loops(ego, &edges, &LoopOptions::default(), &solve(&GraphOptions::default(), threads)).unwrap()
}

fn ate_m(ego: &EgoTrajectory, truth: &[Pose<World, Camera>]) -> f64 {
    let squares = ego
        .frames
        .iter()
        .zip(truth)
        .map(|(f, t)| (f.world_from_camera.translation() - t.translation()).norm_squared());
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

#[test]
fn loops_take_the_drift_and_shrink_the_covariance() {
    let truth = truth();
    let mut ego = drifted(&truth);
    let (before, covariance) = (ate_m(&ego, &truth), ego.frames[2 * ROUND - 1].covariance);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let edges: Vec<LoopEdge> = (0..ROUND).step_by(4).map(|k| edge(&truth, k, k + ROUND, &mut rng)).collect();
    let report = close(&mut ego, &edges, 1);
    let after = ate_m(&ego, &truth);
    assert_eq!(report.closed_count(), edges.len());
    // Both rounds drift alike: only the closing shows it.
    assert!(before > 1.2 && after < before / 2.0, "{before} m, {after} m");
    let last = ego.frames[2 * ROUND - 1].covariance;
    assert!(last.fixed_view::<3, 3>(3, 3).trace() < covariance.fixed_view::<3, 3>(3, 3).trace());
}

/// Loops that disagree with each other by their own errors do not make the odometry less certain, however many there are.
#[test]
fn errors_of_loops_do_not_bend_a_drive_that_does_not_drift() {
    let truth = truth();
    let mut ego = measured(&truth);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let edges: Vec<LoopEdge> = (0..ROUND)
        .flat_map(|k| [edge(&truth, k, k + ROUND, &mut rng), edge(&truth, k, k + ROUND, &mut rng)])
        .collect();
    let report = close(&mut ego, &edges, 1);
    assert!(report.closed_count() == edges.len() && report.odometry_factor < 1.1, "{report:?}");
    assert!(ate_m(&ego, &truth) < 0.05, "{} m", ate_m(&ego, &truth));
}

#[test]
fn a_false_loop_among_true_ones_is_switched_off() {
    let truth = truth();
    let mut ego = drifted(&truth);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut edges: Vec<LoopEdge> =
        (0..ROUND).step_by(8).map(|k| edge(&truth, k, k + ROUND, &mut rng)).collect();
    let mut false_edge = edge(&truth, 20, ROUND + 20, &mut rng);
    false_edge.later = ROUND + 60;
    edges.push(false_edge);
    let report = close(&mut ego, &edges, 1);
    assert!(!report.closed[edges.len() - 1] && report.closed_count() == edges.len() - 1, "{report:?}");
    assert!(ate_m(&ego, &truth) < 1.2, "{}", ate_m(&ego, &truth));
}

#[test]
fn no_loops_change_no_bit_and_threads_none_either() {
    let truth = truth();
    let (untouched, mut ego) = (drifted(&truth), drifted(&truth));
    close(&mut ego, &[], 1);
    let same = |a: &EgoTrajectory, b: &EgoTrajectory| {
        a.frames
            .iter()
            .zip(&b.frames)
            .all(|(a, b)| a.world_from_camera == b.world_from_camera && a.covariance == b.covariance)
    };
    assert!(same(&ego, &untouched));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let edges: Vec<LoopEdge> = (0..ROUND).step_by(8).map(|k| edge(&truth, k, k + ROUND, &mut rng)).collect();
    let mut other = ego.clone();
    close(&mut ego, &edges, 1);
    close(&mut other, &edges, 4);
    assert!(same(&ego, &other) && !same(&ego, &untouched));
}

#[test]
fn a_map_after_a_break_is_put_where_its_loops_say() {
    let truth = truth();
    let mut ego = drifted(&truth);
    // Twenty frames without odometry, after which the rest stands 30 m off and turned.
    let (from, to) = (ROUND + 10, ROUND + 30);
    let wrong: Pose<World, World> = Pose::exp(&Vector6::new(0.0, 0.5, 0.0, 20.0, 0.0, 22.0));
    for k in from..2 * ROUND {
        if k < to {
            ego.frames[k].step_measured = false;
            ego.frames[k].step_covariance =
                Matrix6::from_diagonal(&Vector6::new(8e-5, 8e-5, 8e-5, 0.01, 0.01, 0.01));
        } else {
            ego.frames[k].world_from_camera = wrong * ego.frames[k].world_from_camera;
        }
    }
    ego.frames[to - 1].world_from_camera = wrong * ego.frames[to - 1].world_from_camera;
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let edges: Vec<LoopEdge> =
        (to - ROUND + 2..ROUND - 1).step_by(4).map(|k| edge(&truth, k, k + ROUND, &mut rng)).collect();
    let before = ate_m(&ego, &truth);
    let report = close(&mut ego, &edges, 1);
    assert_eq!(report.closed_count(), edges.len(), "{report:?}");
    // As good as the odometry of the first round, which nothing corrects.
    let apart = |k: usize| {
        let (found, right) = (&ego.frames[k], truth[k - ROUND].inverse() * truth[k]);
        let found = ego.frames[k - ROUND].world_from_camera.inverse() * found.world_from_camera;
        (found.inverse() * right).translation().norm()
    };
    assert!(before > 10.0 && (to + 4..2 * ROUND - 2).all(|k| apart(k) < 0.3), "{before}");
}

/// The world of a map, and edges to it from the frames of the drive.
fn map_edges(
    truth: &[Pose<World, Camera>],
    frames: impl Iterator<Item = usize>,
    rng: &mut ChaCha8Rng,
) -> (Pose<World, World>, Vec<MapEdge>) {
    let map_from_drive = Pose::exp(&Vector6::new(0.02, 0.8, -0.01, 30.0, 1.0, -12.0));
    let beside: Pose<Camera, Camera> = Pose::exp(&Vector6::new(0.0, 0.05, 0.0, 0.6, 0.0, -0.4));
    let of = |frame: usize| {
        let noise = edge(truth, 0, 0, rng);
        MapEdge {
            frame,
            world_from_keyframe: map_from_drive * truth[frame] * beside,
            keyframe_covariance: Matrix6::zeros(),
            camera_from_keyframe: beside * noise.later_from_earlier,
            covariance: noise.covariance,
        }
    };
    (map_from_drive, frames.map(of).collect())
}

#[test]
fn a_map_moves_the_drive_into_its_world_and_takes_the_drift() {
    let truth = truth();
    let mut ego = drifted(&truth);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (map_from_drive, map) = map_edges(&truth, (0..2 * ROUND).step_by(5), &mut rng);
    let edges = PlaceEdges { loops: Vec::new(), map };
    let report =
        close_loops(&mut ego, &edges, &LoopOptions::default(), &solve(&GraphOptions::default(), 1)).unwrap();
    assert!(report.map.iter().all(|(_, holds)| *holds), "{report:?}");
    let there: Vec<Pose<World, Camera>> = truth.iter().map(|pose| map_from_drive * *pose).collect();
    let error = ate_m(&ego, &there);
    assert!(error < 0.06, "{error} m");
    // The frames at the end are known as well as those at the start.
    let sigma = |k: usize| ego.frames[k].covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
    assert!(sigma(0) < 0.15 && sigma(2 * ROUND - 1) < 0.25, "{} {}", sigma(0), sigma(2 * ROUND - 1));
}

#[test]
fn a_false_edge_to_a_map_is_switched_off_and_false_ones_alone_change_nothing() {
    let truth = truth();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (map_from_drive, mut map) = map_edges(&truth, (20..120).step_by(8), &mut rng);
    map[4].world_from_keyframe = map_from_drive * truth[200];
    let mut ego = drifted(&truth);
    let edges = PlaceEdges { loops: Vec::new(), map };
    let report =
        close_loops(&mut ego, &edges, &LoopOptions::default(), &solve(&GraphOptions::default(), 1)).unwrap();
    let off: Vec<usize> = (0..edges.map.len()).filter(|k| !report.map[*k].1).collect();
    assert_eq!(off, [4], "{report:?}");
}

#[test]
fn a_request_to_stop_leaves_the_trajectory_as_it_was() {
    let truth = truth();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let edges = PlaceEdges { loops: vec![edge(&truth, 10, ROUND + 10, &mut rng)], map: Vec::new() };
    let graph = GraphOptions::default();
    let before = drifted(&truth);
    // Asked at every moment of the work: the last of them are at its end.
    for looks in 0.. {
        let left = AtomicUsize::new(looks);
        let asked = || left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_err();
        let mut ego = before.clone();
        let solve = LoopSolve { stop: Stop::new(&asked), ..solve(&graph, 1) };
        match close_loops(&mut ego, &edges, &LoopOptions::default(), &solve) {
            Err(GraphError::Stopped) => {
                let same = ego.frames.iter().zip(&before.frames).all(|(now, before)| {
                    now.world_from_camera == before.world_from_camera && now.covariance == before.covariance
                });
                assert!(same, "after {looks} looks");
            }
            Err(error) => panic!("{error}"),
            Ok(_) => {
                assert!(looks > 5, "only {looks} looks");
                break;
            }
        }
    }
}

/// NEES of the frames of a drive by a map whose keyframes err together, by a draw from their covariance.
#[test]
fn poses_by_a_map_hold_the_covariance_of_the_map() {
    let truth = truth();
    let sigmas = Vector6::new(0.004, 0.02, 0.004, 0.3, 0.1, 0.4);
    let of_map = Matrix6::from_diagonal(&sigmas.component_mul(&sigmas));
    let (mut with, mut without) = (Vec::new(), Vec::new());
    for seed in 0..24 {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
        let (map_from_drive, mut map) = map_edges(&truth, (0..80).step_by(5), &mut rng);
        // Sums of uniform numbers, of variance 1.
        let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
        let middle = map[8].world_from_keyframe;
        let error: Pose<Camera, Camera> = Pose::exp(&sigmas.map(|sigma| sigma * normal()));
        let moved: Pose<World, World> = middle * error.inverse() * middle.inverse();
        for edge in &mut map {
            // The same error of all, as the keyframe of each has it.
            let across = adjoint((edge.world_from_keyframe.inverse() * middle).isometry());
            edge.keyframe_covariance = across * of_map * across.transpose();
            edge.world_from_keyframe = moved * edge.world_from_keyframe;
        }
        let options = (LoopOptions::default(), GraphOptions::default());
        let nees = |known: bool| {
            let mut ego = drifted(&truth);
            let none = |e: &MapEdge| MapEdge { keyframe_covariance: Matrix6::zeros(), ..e.clone() };
            let map = map.iter().map(|e| if known { e.clone() } else { none(e) }).collect();
            let edges = PlaceEdges { loops: Vec::new(), map };
            close_loops(&mut ego, &edges, &options.0, &solve(&options.1, 1)).unwrap();
            let off = ego.frames[40].world_from_camera.inverse() * (map_from_drive * truth[40]);
            let off = motorcade_geometry::lie::se3::log(off.isometry());
            (off.transpose() * inverse(&ego.frames[40].covariance) * off)[(0, 0)]
        };
        with.push(nees(true));
        without.push(nees(false));
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    // 6 degrees of freedom; the edges' own covariances are rather too wide.
    assert!((2.5..8.0).contains(&mean(&with)) && mean(&without) > 20.0, "{} {}", mean(&with), mean(&without));
}
