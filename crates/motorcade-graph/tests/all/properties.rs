//! Properties of any graph.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use crate::common::{difference, information, pose, random, small_drive, tight};
use motorcade_graph::factors::Between;
use motorcade_graph::solver::Method;
use motorcade_graph::{Factor, Graph, GraphError, Options, Solver, g2o, optimise, start};
use nalgebra::{Isometry3, Matrix6};
use proptest::prelude::*;
use rand::seq::SliceRandom;

/// Poses and edges of a random connected graph.
type Parts = (Vec<Isometry3<f64>>, Vec<(usize, usize, Isometry3<f64>, Matrix6<f64>)>);

fn parts(seed: u64, n: usize) -> Parts {
    let rng = &mut random(seed);
    let truth: Vec<_> = (0..n).map(|_| pose(rng, 1.5)).collect();
    let mut edges = Vec::new();
    for j in 1..n {
        for i in [j - 1, (j * 7) % j] {
            let motion = truth[i].inv_mul(&truth[j]) * pose(rng, 0.05);
            edges.push((i, j, motion, information(rng)));
        }
    }
    let start = truth.iter().map(|x| x * pose(rng, 0.1)).collect();
    (start, edges)
}

/// The graph with vertex k added at place `order[k]` and the first vertex fixed.
fn build((poses, edges): &Parts, order: &[usize]) -> Graph {
    let mut graph = Graph::new();
    let mut ids = vec![None; poses.len()];
    for &k in order {
        ids[k] = Some(graph.add_variable(poses[k]));
    }
    for (i, j, motion, m) in edges {
        let factor = Between::new(ids[*i].unwrap(), ids[*j].unwrap(), *motion, *m).unwrap();
        graph.add_factor(factor).unwrap();
    }
    graph.fix(ids[0].unwrap()).unwrap();
    graph
}

fn solve(mut graph: Graph, method: Method) -> Graph {
    optimise(&mut graph, &tight(method)).unwrap();
    graph
}

fn poses(graph: &Graph, order: &[usize]) -> Vec<Isometry3<f64>> {
    let ids: Vec<_> = graph.values().iter().map(|(id, _)| id).collect();
    let mut out = vec![Isometry3::identity(); order.len()];
    for (place, &k) in order.iter().enumerate() {
        out[k] = *graph.values().get(ids[place]).unwrap();
    }
    out
}

fn furthest(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(x, y)| (x.inverse() * y).to_homogeneous())
        .fold(0.0, |m, d| m.max((d - nalgebra::Matrix4::identity()).amax()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn order_of_ids_and_edges_does_not_matter(seed in 0_u64..1000) {
        let n = 30;
        let mut parts = parts(seed, n);
        let order: Vec<usize> = (0..n).collect();
        let a = poses(&solve(build(&parts, &order), Method::LevenbergMarquardt), &order);
        let mut shuffled = order;
        shuffled.shuffle(&mut random(seed));
        parts.1.shuffle(&mut random(seed + 1));
        let b = poses(&solve(build(&parts, &shuffled), Method::LevenbergMarquardt), &shuffled);
        prop_assert!(furthest(&a, &b) < 1e-9, "{}", furthest(&a, &b));
    }

    #[test]
    fn moving_everything_moves_the_solution(seed in 0_u64..1000) {
        let mut parts = parts(seed, 20);
        let order: Vec<usize> = (0..20).collect();
        let a = poses(&solve(build(&parts, &order), Method::LevenbergMarquardt), &order);
        let shift = pose(&mut random(seed + 5), 2.0);
        for x in &mut parts.0 {
            *x = shift * *x;
        }
        let b = poses(&solve(build(&parts, &order), Method::LevenbergMarquardt), &order);
        let moved: Vec<_> = a.iter().map(|x| shift * x).collect();
        prop_assert!(furthest(&moved, &b) < 1e-9);
    }

    #[test]
    fn an_edge_twice_is_an_edge_of_twice_the_information(seed in 0_u64..1000, which in 0_usize..20) {
        let order: Vec<usize> = (0..20).collect();
        let original = parts(seed, 20);
        let which = which % original.1.len();
        let mut twice = original.clone();
        twice.1.push(twice.1[which]);
        let mut heavy = original.clone();
        heavy.1[which].3 *= 2.0;
        let a = solve(build(&twice, &order), Method::GaussNewton);
        let b = solve(build(&heavy, &order), Method::GaussNewton);
        prop_assert!(difference(&a, &b) < 1e-9);
        // And it is not the graph without the copy.
        let c = solve(build(&original, &order), Method::GaussNewton);
        prop_assert!(difference(&a, &c) > 1e-7);
    }
}

#[test]
fn methods_agree() {
    let solved = solve(small_drive(1), Method::LevenbergMarquardt);
    for method in [Method::GaussNewton, Method::DogLeg] {
        assert!(difference(&solved, &solve(small_drive(1), method)) < 1e-8);
    }
    let gradient: f64 = solved.cost().unwrap();
    assert!(gradient < small_drive(1).cost().unwrap());
}

#[test]
fn threads_change_no_bit() {
    let run = |threads| {
        let options = motorcade_graph::generate::DriveOptions { frames: 2000, ..Default::default() };
        let mut graph = motorcade_graph::generate::drive(&options).unwrap().graph;
        let report = optimise(&mut graph, &Options { threads, ..Options::default() }).unwrap();
        (graph, report.final_cost)
    };
    let (one, cost) = run(1);
    for threads in [2, 5] {
        let (other, other_cost) = run(threads);
        assert_eq!(cost.to_bits(), other_cost.to_bits());
        assert_eq!(one.values().iter().collect::<Vec<_>>(), other.values().iter().collect::<Vec<_>>());
    }
}

#[test]
fn fixed_variables_do_not_move() {
    let mut graph = small_drive(2);
    let ids: Vec<_> = graph.values().iter().map(|(id, _)| id).collect();
    for &id in &ids[10..14] {
        graph.fix(id).unwrap();
    }
    let before = graph.values().clone();
    optimise(&mut graph, &Options::default()).unwrap();
    for (k, &id) in ids.iter().enumerate() {
        let same = graph.values().value(id).unwrap() == before.value(id).unwrap();
        assert_eq!(same, k == 0 || (10..14).contains(&k));
    }
    for &id in &ids {
        graph.fix(id).unwrap();
    }
    let report = optimise(&mut graph, &Options::default()).unwrap();
    assert!(report.converged() && report.iterations.is_empty());
}

#[test]
fn a_solver_is_reused_after_the_graph_grew() {
    let mut graph = small_drive(3);
    let mut solver = Solver::new(tight(Method::LevenbergMarquardt)).unwrap();
    solver.optimise(&mut graph).unwrap();
    let warm = solver.optimise(&mut graph).unwrap();
    assert!(warm.iterations.len() <= 2);
    let last = graph.values().iter().last().unwrap().0;
    let at = *graph.values().get::<Isometry3<f64>>(last).unwrap();
    let new = graph.add_variable(at);
    let motion = pose(&mut random(9), 0.3);
    graph.add_factor(Between::new(last, new, motion, Matrix6::identity()).unwrap()).unwrap();
    solver.optimise(&mut graph).unwrap();
    let got = graph.values().get::<Isometry3<f64>>(last).unwrap().inv_mul(graph.values().get(new).unwrap());
    assert!(furthest(&[got], &[motion]) < 1e-9);
}

#[test]
fn starts_lead_to_the_same_minimum() {
    let solved = solve(small_drive(4), Method::LevenbergMarquardt);
    for initialise in [start::chordal, start::spanning_tree] {
        let mut graph = small_drive(4);
        let rng = &mut random(4);
        let ids: Vec<_> = graph.values().iter().map(|(id, _)| id).collect();
        for &id in &ids[1..] {
            graph.values_mut().set(id, pose(rng, 3.0)).unwrap();
        }
        let lost = graph.cost().unwrap();
        initialise(&mut graph).unwrap();
        assert!(graph.cost().unwrap() < 1e-3 * lost);
        assert!(difference(&solved, &solve(graph, Method::LevenbergMarquardt)) < 1e-8);
    }
}

#[test]
fn a_chordal_start_is_exact_without_noise() {
    let rng = &mut random(6);
    let truth: Vec<_> = (0..40).map(|_| pose(rng, 1.8)).collect();
    let mut graph = Graph::new();
    let ids: Vec<_> = truth.iter().map(|x| graph.add_variable(x * pose(rng, 1.0))).collect();
    graph.values_mut().set(ids[0], truth[0]).unwrap();
    graph.fix(ids[0]).unwrap();
    for j in 1..40 {
        for i in [j - 1, j / 2] {
            if i != j {
                let factor =
                    Between::new(ids[i], ids[j], truth[i].inv_mul(&truth[j]), information(rng)).unwrap();
                graph.add_factor(factor).unwrap();
            }
        }
    }
    start::chordal(&mut graph).unwrap();
    assert!(graph.cost().unwrap() < 1e-18);
}

#[test]
fn floating_and_broken_graphs_are_named() {
    let (poses, edges) = parts(1, 5);
    let mut graph = build(&(poses, edges), &[0, 1, 2, 3, 4]);
    let first = graph.fixed()[0];
    graph.release(first);
    let gauss_newton = Options { method: Method::GaussNewton, ..Options::default() };
    // A floating graph is singular up to rounding; what is refused or not, nothing may become NaN.
    if let Err(error) = optimise(&mut graph, &gauss_newton) {
        assert!(matches!(error, GraphError::Singular), "{error}");
    }
    assert!(graph.cost().unwrap().is_finite());
    let mut indefinite = Matrix6::identity();
    indefinite[(2, 2)] = -1.0;
    let id = graph.values().iter().next().unwrap().0;
    assert!(Between::new(id, id, Isometry3::identity(), indefinite).is_err());
    let same = Between::new(id, id, Isometry3::identity(), Matrix6::identity()).unwrap();
    assert!(graph.add_factor(same).is_err());
    assert!(Solver::new(Options { step_size: f64::NAN, ..Options::default() }).is_err());
}

#[test]
fn components_are_found_and_anchored() {
    let mut graph = Graph::new();
    let ids: Vec<_> = (0..7).map(|_| graph.add_variable(Isometry3::identity())).collect();
    for (a, b) in [(0, 1), (1, 2), (3, 4), (5, 4)] {
        let factor = Between::new(ids[a], ids[b], Isometry3::translation(1.0, 0.0, 0.0), Matrix6::identity());
        graph.add_factor(factor.unwrap()).unwrap();
    }
    let sizes: Vec<usize> = graph.components().iter().map(Vec::len).collect();
    assert_eq!(sizes, [3, 3, 1]);
    graph.fix(ids[1]).unwrap();
    assert_eq!(graph.anchor_components().unwrap(), [ids[3], ids[6]]);
    assert!(optimise(&mut graph, &Options::default()).unwrap().final_cost < 1e-12);
}

#[test]
fn cancellation_and_limits_stop_a_solve() {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    let (flag, calls) =
        (std::sync::Arc::new(AtomicBool::new(true)), std::sync::Arc::new(AtomicUsize::new(0)));
    let counter = calls.clone();
    let control = motorcade_graph::solver::Control {
        cancel: Some(flag),
        progress: Some(std::sync::Arc::new(move |_| {
            counter.fetch_add(1, Ordering::Relaxed);
        })),
    };
    let mut graph = small_drive(8);
    let report =
        Solver::new(tight(Method::LevenbergMarquardt)).unwrap().with_control(control).optimise(&mut graph);
    let report = report.unwrap();
    assert_eq!(report.termination, motorcade_graph::solver::Termination::Cancelled);
    assert_eq!((report.iterations.len(), calls.load(Ordering::Relaxed)), (1, 1));
    let limited = Options { time_limit_s: Some(0.0), ..tight(Method::DogLeg) };
    let report = optimise(&mut small_drive(8), &limited).unwrap();
    assert_eq!(report.termination, motorcade_graph::solver::Termination::Time);
    let limited = Options { max_iterations: 2, ..tight(Method::GaussNewton) };
    assert_eq!(optimise(&mut small_drive(8), &limited).unwrap().iterations.len(), 2);
}

/// Poses tied to each other all over, whose factor is a nearly full matrix.
fn tied_all_over(poses: usize) -> Graph {
    let mut graph = Graph::new();
    let ids: Vec<_> =
        (0..poses).map(|k| graph.add_variable(Isometry3::translation(k as f64, 0.1, 0.0))).collect();
    graph.fix(ids[0]).unwrap();
    for k in 1..poses {
        for other in [k - 1, 104_729 % k, 224_737 % k, 350_377 % k, 479_909 % k] {
            let ahead = Isometry3::translation((k - other) as f64, 0.0, 0.0);
            let between = Between::new(ids[other], ids[k], ahead, Matrix6::identity());
            graph.add_factor(between.unwrap()).unwrap();
        }
    }
    graph
}

#[test]
fn cancellation_and_limits_stop_a_long_factorisation() {
    use motorcade_graph::solver::{Control, Termination};
    const POSES: usize = 900;
    let start = tied_all_over(POSES);
    let ended = |options: Options, cancelled: bool| {
        let mut graph = tied_all_over(POSES);
        let cancel = Some(std::sync::Arc::new(std::sync::atomic::AtomicBool::new(cancelled)));
        let mut solver = Solver::new(options).unwrap().with_control(Control { cancel, progress: None });
        let report = solver.optimise(&mut graph).unwrap();
        assert!(report.factor_multiplications > 1e9, "{}", report.factor_multiplications);
        assert_eq!(report.initial_cost, report.final_cost);
        assert!(graph.values() == start.values() && report.iterations.is_empty());
        report.termination
    };
    for method in [Method::GaussNewton, Method::LevenbergMarquardt, Method::DogLeg] {
        for threads in [1, 2] {
            let options = Options { method, threads, ..Options::default() };
            assert_eq!(ended(options.clone(), true), Termination::Cancelled);
            assert_eq!(ended(Options { time_limit_s: Some(0.0), ..options }, false), Termination::Time);
        }
    }
}

#[test]
fn files_keep_every_bit() {
    let graph = small_drive(5);
    let ids: Vec<_> = graph.values().iter().map(|(id, _)| (10 + 3 * id.index() as u64, id)).collect();
    let text = g2o::to_string(&graph, &ids);
    let again = g2o::parse(&text, "memory".as_ref(), &g2o::ReadOptions::default()).unwrap();
    assert_eq!(again.vertices, ids);
    // Reading normalises quaternions, which may move the last bit.
    assert!(difference(&graph, &again.graph) < 1e-15);
    assert_eq!(graph.fixed(), again.graph.fixed());
    for ((_, a), (_, b)) in graph.factors().zip(again.graph.factors()) {
        let view = |f: &dyn Factor| -> Vec<f64> { f.information().iter().copied().collect() };
        assert_eq!((a.variables(), view(a)), (b.variables(), view(b)));
        let (a, b) = (a.relative_pose().unwrap(), b.relative_pose().unwrap());
        assert!((a.measurement.to_homogeneous() - b.measurement.to_homogeneous()).amax() < 1e-15);
    }
}
