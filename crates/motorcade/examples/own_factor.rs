//! A factor of one's own in a pose graph: altitudes of a car, as a barometer measures them, level out a drifting odometry.

#![allow(clippy::print_stdout, reason = "an example talks")]

use motorcade_graph::factors::Between;
use motorcade_graph::{Factor, Graph, GraphError, Options, Terms, Values, VariableId, numeric, optimise};
use nalgebra::{DMatrixViewMut, DVectorViewMut, Isometry3, Matrix1, Matrix6, UnitQuaternion, Vector3};

/// Measured altitude of a pose `X = world_from_camera`; the world's y axis points down. `r = −e_yᵀ t − altitude` (1).
#[derive(Debug)]
struct Altitude {
    pose: [VariableId; 1],
    altitude_m: f64,
    /// 1/σ² \[1/m²\].
    information: Matrix1<f64>,
}

impl Factor for Altitude {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.pose, &self.information)
    }

    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let pose = values.get::<Isometry3<f64>>(self.pose[0])?;
        residual[0] = -pose.translation.y - self.altitude_m;
        if let Some(jacobian) = jacobian {
            // Right perturbation [ω, ν]: t(X exp δ) ≈ t + R ν, so ∂r/∂ν = −e_yᵀ R (1×3).
            let rotation = pose.rotation.to_rotation_matrix();
            jacobian.view_mut((0, 3), (1, 3)).copy_from(&-rotation.matrix().row(1));
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Ten steps of 10 m on a level road; the odometry pitches up by 0.2° a step.
    let pitch = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.2_f64.to_radians());
    let step = Isometry3::from_parts(Vector3::new(0.0, 0.0, 10.0).into(), pitch);
    let mut graph = Graph::new();
    let mut poses = vec![graph.add_variable(Isometry3::identity())];
    graph.fix(poses[0])?;
    for k in 0..10 {
        let guess = *graph.values().get::<Isometry3<f64>>(poses[k])? * step;
        poses.push(graph.add_variable(guess));
        graph.add_factor(Between::new(poses[k], poses[k + 1], step, Matrix6::identity() * 1e4)?)?;
    }
    let altitude = |graph: &Graph| graph.values().get::<Isometry3<f64>>(poses[10]).map(|p| -p.translation.y);
    println!("altitude after 100 m by odometry: {:.2} m", altitude(&graph)?);

    for pose in &poses[1..] {
        let factor =
            Altitude { pose: [*pose], altitude_m: 0.0, information: Matrix1::new(1.0 / 0.1_f64.powi(2)) };
        println!("Jacobian against differences: {:.1e}", numeric::jacobian_error(&factor, graph.values())?);
        graph.add_factor(factor)?;
    }
    let report = optimise(&mut graph, &Options::default())?;
    println!("with altitudes: {:.2} m, cost {:.3}", altitude(&graph)?, report.final_cost);
    Ok(())
}
