//! Every factor's derivatives against central differences.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use crate::common::{information, pose, random};
use motorcade_geometry::lie::sim3::Similarity;
use motorcade_graph::factors::*;
use motorcade_graph::numeric::{jacobian_error, normal_equations_error};
use motorcade_graph::{Factor, Graph, Manifold, Robust, RobustKernel, Value};
use nalgebra::{DMatrix, DVector, Isometry2, Isometry3, Matrix3, Point3, Vector2};
use rand::Rng;

fn check(graph: &Graph, factor: &dyn Factor) {
    let error = jacobian_error(factor, graph.values()).unwrap();
    assert!(error < 2e-8, "{factor:?}: Jacobian off by {error}");
    let error = normal_equations_error(factor, graph.values()).unwrap();
    assert!(error < 1e-12, "{factor:?}: normal equations off by {error}");
}

#[test]
fn between_poses() {
    let rng = &mut random(1);
    for limit in [1e-9, 1e-4, 0.02, 0.3, 1.0, 1.5] {
        for residual in [PoseResidual::Log, PoseResidual::Mqt] {
            let mut graph = Graph::new();
            let a = pose(rng, 1.5);
            // The error motion has the size of `limit`.
            let (motion, error) = (pose(rng, 1.5), pose(rng, limit));
            let (i, j) = (graph.add_variable(a), graph.add_variable(a * motion * error));
            let factor = Between::new(i, j, motion, information(rng)).unwrap().with_residual(residual);
            check(&graph, &factor);
            check(&graph, &Robust::new(factor, RobustKernel::Cauchy(1.0)));
        }
    }
}

#[test]
fn between_poses_near_half_a_turn() {
    let rng = &mut random(2);
    for residual in [PoseResidual::Log, PoseResidual::Mqt] {
        let mut graph = Graph::new();
        let turn =
            Isometry3::new(nalgebra::Vector3::new(0.4, 2.0, -1.0), nalgebra::Vector3::new(0.0, 3.1, 0.3));
        let (i, j) = (graph.add_variable(Isometry3::identity()), graph.add_variable(turn));
        check(
            &graph,
            &Between::new(i, j, Isometry3::identity(), information(rng)).unwrap().with_residual(residual),
        );
    }
}

#[test]
fn priors_and_points() {
    let rng = &mut random(3);
    let mut graph = Graph::new();
    let x = graph.add_variable(pose(rng, 1.2));
    check(&graph, &PosePrior::new(x, pose(rng, 1.2), information(rng)).unwrap());
    let point = graph.add_variable(DVector::from_vec(vec![3.0, -1.0, 7.0]));
    let m = information(rng).fixed_view::<3, 3>(0, 0).into_owned();
    check(&graph, &PoseToPoint::new(x, point, Point3::new(1.0, 2.0, 3.0), m).unwrap());
    let prior =
        VectorPrior::new(point, DVector::from_element(3, 0.5), DMatrix::identity(3, 3) * 2.0).unwrap();
    check(&graph, &prior);
}

#[test]
fn between_in_the_plane() {
    let mut graph = Graph::new();
    let i = graph.add_variable(Isometry2::new(Vector2::new(1.0, 2.0), 0.7));
    let j = graph.add_variable(Isometry2::new(Vector2::new(-1.0, 3.5), -2.1));
    let m = Matrix3::new(4.0, 0.5, 0.1, 0.5, 3.0, 0.2, 0.1, 0.2, 2.0);
    check(&graph, &BetweenPlane::new(i, j, Isometry2::new(Vector2::new(0.3, -0.4), -1.9), m).unwrap());
}

fn similarity(rng: &mut impl Rng) -> Similarity {
    let delta: Vec<f64> = (0..7).map(|_| rng.random_range(-0.8..0.8)).collect();
    Similarity::identity().retract(&delta)
}

#[test]
fn between_similarities() {
    let rng = &mut random(4);
    let mut graph = Graph::new();
    let (a, b, z) = (similarity(rng), similarity(rng), similarity(rng));
    let (i, j) = (graph.add_variable(a), graph.add_variable(b));
    let g = DMatrix::from_fn(7, 7, |_, _| rng.random_range(-1.0..1.0));
    let m = &g * g.transpose();
    check(&graph, &BetweenSimilarity::new(i, j, z, m).unwrap());
}

#[test]
fn linear_prior_over_all_spaces() {
    let rng = &mut random(5);
    let mut graph = Graph::new();
    let now: [Value; 4] = [
        pose(rng, 0.8).into(),
        Isometry2::new(Vector2::new(1.0, 2.0), 0.7).into(),
        similarity(rng).into(),
        DVector::from_vec(vec![1.0, 2.0]).into(),
    ];
    let at = now.clone().map(|x| {
        let delta: Vec<f64> = (0..x.dof()).map(|_| rng.random_range(-0.5..0.5)).collect();
        x.retract(&delta)
    });
    let ids = now.map(|x| graph.add_variable(x)).to_vec();
    let n = 6 + 3 + 7 + 2;
    let g = DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
    let offset = DVector::from_fn(n, |_, _| rng.random_range(-1.0..1.0));
    check(&graph, &LinearPrior::new(ids, at.to_vec(), offset, &g * g.transpose()).unwrap());
}
