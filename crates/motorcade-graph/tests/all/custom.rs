//! A factor of one's own: three poses and a scale, mixed sizes.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use crate::common::{pose, random, tight};
use motorcade_geometry::lie::se3;
use motorcade_graph::factors::{PosePrior, VectorPrior};
use motorcade_graph::numeric::jacobian_error;
use motorcade_graph::solver::Method;
use motorcade_graph::{Factor, Graph, GraphError, Marginals, Terms, Values, VariableId, optimise};
use nalgebra::{DMatrix, DMatrixViewMut, DVector, DVectorViewMut, Isometry3, Matrix6};

/// Distance from b to c is e^λ times the distance from a to b: residual 1, three poses and a number.
#[derive(Debug)]
struct Stretch {
    variables: [VariableId; 4],
    information: DMatrix<f64>,
}

impl Factor for Stretch {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let [a, b, c, scale] = self.variables;
        let (a, b, c) = (
            values.get::<Isometry3<f64>>(a)?,
            values.get::<Isometry3<f64>>(b)?,
            values.get::<Isometry3<f64>>(c)?,
        );
        let factor = values.scalar(scale)?.exp();
        let (ab, bc) =
            (b.translation.vector - a.translation.vector, c.translation.vector - b.translation.vector);
        residual[0] = bc.norm() - factor * ab.norm();
        if let Some(j) = jacobian {
            let (u, v) = (ab.normalize(), bc.normalize());
            // Positions move by R ν.
            j.view_mut((0, 3), (1, 3)).copy_from(&(a.rotation.inverse() * u * factor).transpose());
            j.view_mut((0, 9), (1, 3)).copy_from(&(b.rotation.inverse() * (-v - u * factor)).transpose());
            j.view_mut((0, 15), (1, 3)).copy_from(&(c.rotation.inverse() * v).transpose());
            j[(0, 18)] = -factor * ab.norm();
        }
        Ok(())
    }
}

#[test]
fn mixed_sizes_are_solved_like_dense() {
    let rng = &mut random(1);
    let mut graph = Graph::new();
    let n = 12;
    let poses: Vec<_> = (0..n)
        .map(|k| graph.add_variable(Isometry3::translation(k as f64, 0.3 * k as f64, 0.0) * pose(rng, 0.2)))
        .collect();
    let scale = graph.add_variable(0.1);
    for (k, &id) in poses.iter().enumerate() {
        let at = Isometry3::translation(1.1_f64.powi(k as i32) * 10.0, 0.0, 0.0) * pose(rng, 0.1);
        graph.add_factor(PosePrior::new(id, at, Matrix6::identity()).unwrap()).unwrap();
    }
    let weak = DMatrix::from_element(1, 1, 0.01);
    graph.add_factor(VectorPrior::new(scale, DVector::zeros(1), weak).unwrap()).unwrap();
    for w in poses.windows(3) {
        let factor =
            Stretch { variables: [w[0], w[1], w[2], scale], information: DMatrix::from_element(1, 1, 25.0) };
        assert!(jacobian_error(&factor, graph.values()).unwrap() < 1e-7);
        graph.add_factor(factor).unwrap();
    }
    let report = optimise(&mut graph, &tight(Method::LevenbergMarquardt)).unwrap();
    assert!(report.final_cost < 0.2 * report.initial_cost && report.unknowns == 6 * n + 1);
    let found = graph.values().scalar(scale).unwrap();
    assert!((found - 1.1_f64.ln()).abs() < 0.05, "{found}");
    // At the minimum no coordinate direction lowers the cost.
    let cost = graph.cost().unwrap();
    for &id in &poses {
        let at = *graph.values().get::<Isometry3<f64>>(id).unwrap();
        for k in 0..6 {
            for sign in [-1.0, 1.0] {
                let mut d = nalgebra::Vector6::zeros();
                d[k] = sign * 1e-4;
                graph.values_mut().set(id, at * se3::exp(&d)).unwrap();
                assert!(graph.cost().unwrap() > cost);
            }
        }
        graph.values_mut().set(id, at).unwrap();
    }
    let marginals = Marginals::new(&graph).unwrap();
    let joint = marginals.joint(&[scale, poses[3]]).unwrap();
    assert_eq!(joint.shape(), (7, 7));
    assert!(joint[(0, 0)] > 0.0 && joint.cholesky().is_some());
}
