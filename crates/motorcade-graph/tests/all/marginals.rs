//! Covariances and marginalisation against dense algebra.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use crate::common::{small_drive, tight};
use motorcade_geometry::robust::median;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::solver::Method;
use motorcade_graph::{
    Factor, FixedLag, Graph, GraphError, Manifold, Marginals, Options, Stop, VariableId, marginalise,
    optimise,
};
use nalgebra::{DMatrix, DMatrixViewMut, DVectorViewMut, Isometry3};

/// H of all free variables in the order of their ids, out of `evaluate` alone.
fn dense(graph: &Graph) -> (Vec<VariableId>, DMatrix<f64>) {
    let free: Vec<VariableId> =
        graph.values().iter().map(|(id, _)| id).filter(|&id| !graph.is_fixed(id)).collect();
    let n = 6 * free.len();
    let mut h = DMatrix::zeros(n, n);
    for (_, factor) in graph.factors() {
        let (m, vars) = (factor.dim(), factor.variables());
        let (mut r, mut j) = (vec![0.0; m], DMatrix::zeros(m, 6 * vars.len()));
        let mut view = DMatrixViewMut::from_slice(j.as_mut_slice(), m, 6 * vars.len());
        factor.evaluate(graph.values(), &mut DVectorViewMut::from_slice(&mut r, m), Some(&mut view)).unwrap();
        let mut wide = DMatrix::zeros(m, n);
        for (k, id) in vars.iter().enumerate() {
            if let Ok(at) = free.binary_search(id) {
                wide.columns_mut(6 * at, 6).copy_from(&j.columns(6 * k, 6));
            }
        }
        h += wide.transpose() * factor.information() * &wide;
    }
    (free, h)
}

fn solved(seed: u64) -> Graph {
    let mut graph = small_drive(seed);
    optimise(&mut graph, &tight(Method::LevenbergMarquardt)).unwrap();
    graph
}

#[test]
fn the_logarithm_of_the_determinant_is_that_of_dense_algebra() {
    let graph = solved(2);
    let (_, h) = dense(&graph);
    let expected: f64 =
        2.0 * h.cholesky().unwrap().l().diagonal().iter().map(|pivot| pivot.ln()).sum::<f64>();
    let found = Marginals::log_determinant(&graph, Stop::NEVER).unwrap();
    assert!((found / expected - 1.0).abs() < 1e-12, "{found}, {expected}");
}

#[test]
fn covariances_are_blocks_of_the_inverse() {
    let graph = solved(1);
    let (free, h) = dense(&graph);
    let inverse = h.try_inverse().unwrap();
    let marginals = Marginals::new(&graph).unwrap();
    let scale = inverse.amax();
    for (k, &a) in free.iter().enumerate() {
        for (l, &b) in free.iter().enumerate() {
            let expected = inverse.view((6 * k, 6 * l), (6, 6));
            let error = (marginals.cross(a, b).unwrap() - expected).amax() / scale;
            assert!(error < 1e-9, "({a}, {b}): {error}");
        }
    }
    let joint = marginals.joint(&[free[5], free[0], free[9]]).unwrap();
    assert!((joint.view((0, 6), (6, 6)) - inverse.view((30, 0), (6, 6))).amax() / scale < 1e-9);
    assert!(joint.cholesky().is_some());
    let fixed = graph.fixed()[0];
    assert_eq!(marginals.covariance(fixed).unwrap(), DMatrix::zeros(6, 6));
}

#[test]
fn covariances_of_sets_are_those_of_all() {
    let graph = solved(1);
    let all = Marginals::new(&graph).unwrap();
    let ids: Vec<VariableId> = graph.values().iter().map(|(id, _)| id).collect();
    // Neighbours, variables of different frames, the fixed one among them, and one alone.
    let far = [ids[0], ids[ids.len() - 1], ids[7]];
    let sets = [vec![ids[3], ids[4]], far.to_vec(), vec![ids[9]]];
    let chosen = Marginals::of_sets(&graph, &sets, Stop::NEVER).unwrap();
    for set in &sets {
        let (joint, expected) = (chosen.joint(set).unwrap(), all.joint(set).unwrap());
        assert!((joint - &expected).amax() < 1e-9 * expected.amax());
    }
    let (a, b) = (chosen.cross(far[1], far[2]).unwrap(), chosen.cross(far[2], far[1]).unwrap());
    assert_eq!(a, b.transpose());
    assert!(matches!(chosen.cross(ids[3], ids[9]), Err(GraphError::NotAskedFor(..))));
    assert!(matches!(chosen.covariance(ids[5]), Err(GraphError::NotAskedFor(..))));
}

#[test]
fn marginalising_at_the_minimum_changes_neither_solution_nor_covariance() {
    let mut graph = solved(2);
    let before = Marginals::new(&graph).unwrap();
    let cost = graph.cost().unwrap();
    let all: Vec<VariableId> = graph.values().iter().map(|(id, _)| id).collect();
    // Vehicles of the first half, and some cameras.
    let gone: Vec<VariableId> = all[1..40].to_vec();
    assert!(marginalise(&mut graph, &gone).unwrap().is_some());
    assert!(graph.cost().unwrap() < cost);
    let after = Marginals::new(&graph).unwrap();
    for &id in &all[40..] {
        let (a, b) = (before.covariance(id).unwrap(), after.covariance(id).unwrap());
        assert!((&a - &b).amax() < 1e-8 * a.amax(), "{id}");
    }
    let values = graph.values().clone();
    optimise(&mut graph, &tight(Method::LevenbergMarquardt)).unwrap();
    for (id, x) in values.iter() {
        let mut d = [0.0; 6];
        x.local(graph.values().value(id).unwrap(), &mut d);
        assert!(d.iter().all(|v| v.abs() < 1e-8), "{id}: {d:?}");
    }
}

/// Feeds a generated drive frame by frame; returns the smoother and the seconds of each frame.
fn run_online(graph: &Graph, per_frame: usize, lag: usize) -> (FixedLag, Vec<f64>) {
    let options = Options { max_iterations: 4, ..Options::default() };
    let mut online = FixedLag::new(lag, options).unwrap();
    let all: Vec<VariableId> = graph.values().iter().map(|(id, _)| id).collect();
    let mut pending: Vec<&dyn Factor> = graph.factors().map(|f| f.1).collect();
    let mut seconds = Vec::new();
    for frame in all.chunks(per_frame) {
        let start = std::time::Instant::now();
        let added: Vec<VariableId> = frame
            .iter()
            .map(|&id| online.graph_mut().add_variable(*graph.values().get::<Isometry3<f64>>(id).unwrap()))
            .collect();
        assert_eq!(added, frame);
        if frame[0].index() == 0 {
            online.graph_mut().fix(frame[0]).unwrap();
        }
        let newest = frame[frame.len() - 1];
        let ready = pending.iter().take_while(|f| f.variables().iter().all(|v| *v <= newest)).count();
        for factor in pending.drain(..ready) {
            let relative = factor.relative_pose().unwrap();
            let [a, b] = factor.variables() else { panic!() };
            let copy =
                motorcade_graph::factors::Between::new(*a, *b, *relative.measurement, *relative.information);
            online.graph_mut().add_factor(copy.unwrap()).unwrap();
        }
        online.advance(added).unwrap();
        online.optimise().unwrap();
        seconds.push(start.elapsed().as_secs_f64());
    }
    (online, seconds)
}

#[test]
fn fixed_lag_follows_the_batch_solution_at_constant_cost() {
    let options = DriveOptions { frames: 300, vehicles: 3, track_length: 20, lap: 0, seed: 3 };
    let mut graph = drive(&options).unwrap().graph;
    let (online, mut seconds) = run_online(&graph, 4, 20);
    assert_eq!(online.graph().values().len(), 20 * 4);
    optimise(&mut graph, &tight(Method::LevenbergMarquardt)).unwrap();
    // Factors of this drive span at most four frames: the window loses nothing but the past's relinearisation.
    for (id, x) in online.graph().values().iter() {
        let mut d = [0.0; 6];
        x.local(graph.values().value(id).unwrap(), &mut d);
        assert!(d.iter().all(|v| v.abs() < 2e-3), "{id}: {d:?}");
    }
    let (early, late) = (median(&mut seconds[40..100]).unwrap(), median(&mut seconds[240..]).unwrap());
    println!("fixed lag: {:.2} ms a frame early, {:.2} ms late", early * 1e3, late * 1e3);
    assert!(late < 3.0 * early, "{early} {late}");
}

#[test]
fn marginalising_everything_leaves_nothing() {
    let mut graph = solved(4);
    let all: Vec<VariableId> = graph.values().iter().map(|(id, _)| id).collect();
    assert!(marginalise(&mut graph, &all).unwrap().is_none());
    assert!(graph.values().is_empty() && graph.factors().len() == 0);
}
