//! How vehicles move: factors on consecutive poses of one vehicle, in its own body frame.
//!
//! In the body frame the residuals do not depend on where the world's origin lies.

use motorcade_geometry::lie::se3;
use motorcade_graph::{Factor, GraphError, Terms, Values, VariableId};
use nalgebra::{DMatrix, DMatrixViewMut, DVectorViewMut, Isometry3, Matrix6};

/// Constant body velocity over three poses (6): `r = log((A⁻¹)(B))`, A = V₀⁻¹V₁, B = V₁⁻¹V₂.
#[derive(Debug)]
pub struct SteadyMotion {
    variables: [VariableId; 3],
    information: DMatrix<f64>,
}

impl SteadyMotion {
    /// Information (6×6) of the change of motion per step, `[ω, ν]`.
    pub fn new(variables: [VariableId; 3], information: &Matrix6<f64>) -> Self {
        Self { variables, information: DMatrix::from_fn(6, 6, |r, c| information[(r, c)]) }
    }
}

impl Factor for SteadyMotion {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let pose = |k: usize| values.get::<Isometry3<f64>>(self.variables[k]);
        let (v0, v1, v2) = (pose(0)?, pose(1)?, pose(2)?);
        let (a, b) = (v0.inverse() * v1, v1.inverse() * v2);
        let e = a.inverse() * b;
        let r = se3::log(&e);
        residual.copy_from(&r);
        if let Some(j) = jacobian {
            let jr = se3::right_jacobian_inverse(&r);
            let ad_b = se3::adjoint(&b.inverse());
            // ∂r/∂V₀ = Jr⁻¹ Ad(B⁻¹), ∂r/∂V₁ = −Jr⁻¹ (Ad(E⁻¹) + Ad(B⁻¹)), ∂r/∂V₂ = Jr⁻¹   (6×6 each)
            j.view_mut((0, 0), (6, 6)).copy_from(&(jr * ad_b));
            j.view_mut((0, 6), (6, 6)).copy_from(&(-jr * (se3::adjoint(&e.inverse()) + ad_b)));
            j.view_mut((0, 12), (6, 6)).copy_from(&jr);
        }
        Ok(())
    }
}

/// Rolling without side slip (4): of the twist `[ω, ν] = log(V₀⁻¹V₁)` roll, pitch and up vanish, and so does what the rear axle
/// moves sideways, `ν_y − a ω_z` with the axle a behind the vehicle's origin. Motion along an arc has exactly such a twist. The
/// middle of a long vehicle does slip in a bend.
#[derive(Debug)]
pub struct NoSideSlip {
    variables: [VariableId; 2],
    rear_axle_m: f64,
    information: DMatrix<f64>,
}

/// Roll rate, pitch rate, sideways, up.
const HELD: [usize; 4] = [0, 1, 4, 5];
/// Yaw rate.
const YAW: usize = 2;
/// Place of the sideways motion among the held ones.
const SIDEWAYS: usize = 2;

impl NoSideSlip {
    /// Standard deviations of roll, pitch \[rad\], sideways and up \[m\] per step; the rear axle that far behind the origin \[m\].
    pub fn new(variables: [VariableId; 2], rear_axle_m: f64, sigmas: [f64; 4]) -> Self {
        Self {
            variables,
            rear_axle_m,
            information: DMatrix::from_fn(4, 4, |r, c| if r == c { sigmas[r].powi(-2) } else { 0.0 }),
        }
    }
}

impl Factor for NoSideSlip {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let v0 = values.get::<Isometry3<f64>>(self.variables[0])?;
        let v1 = values.get::<Isometry3<f64>>(self.variables[1])?;
        let d = v0.inverse() * v1;
        let twist = se3::log(&d);
        for (row, k) in HELD.into_iter().enumerate() {
            residual[row] = twist[k];
        }
        residual[SIDEWAYS] -= self.rear_axle_m * twist[YAW];
        if let Some(j) = jacobian {
            let second = se3::right_jacobian_inverse(&twist);
            let first = -second * se3::adjoint(&d.inverse());
            for (row, k) in HELD.into_iter().enumerate() {
                let lever = if row == SIDEWAYS { self.rear_axle_m } else { 0.0 };
                j.view_mut((row, 0), (1, 6)).copy_from(&(first.row(k) - first.row(YAW) * lever));
                j.view_mut((row, 6), (1, 6)).copy_from(&(second.row(k) - second.row(YAW) * lever));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_graph::{Graph, numeric};
    use nalgebra::Vector6;

    #[test]
    fn jacobians_match_differences() {
        let mut graph = Graph::new();
        let at = |x: [f64; 6]| se3::exp(&Vector6::from_row_slice(&x));
        let a = graph.add_variable(at([0.01, -0.02, 0.3, 1.0, 2.0, 0.1]));
        let b = graph.add_variable(at([0.02, 0.01, 0.4, 2.1, 2.2, 0.0]));
        let c = graph.add_variable(at([0.0, 0.01, 0.55, 3.0, 2.9, 0.2]));
        let steady = SteadyMotion::new([a, b, c], &Matrix6::identity());
        assert!(numeric::jacobian_error(&steady, graph.values()).unwrap() < 1e-6);
        let rolling = NoSideSlip::new([a, b], 1.3, [0.01, 0.01, 0.05, 0.05]);
        assert!(numeric::jacobian_error(&rolling, graph.values()).unwrap() < 1e-6);
    }

    #[test]
    fn motion_along_an_arc_costs_nothing() {
        let mut graph = Graph::new();
        // The origin lies 1.3 m before the axle, which goes round on a circle of 12 m.
        let twist = Vector6::new(0.0, 0.0, 0.1, 1.2, 0.13, 0.0);
        let start = se3::exp(&Vector6::new(0.1, 0.2, 1.0, 4.0, 5.0, 6.0));
        let ids: Vec<_> =
            (0..3).map(|k| graph.add_variable(start * se3::exp(&(twist * f64::from(k))))).collect();
        graph.add_factor(SteadyMotion::new([ids[0], ids[1], ids[2]], &Matrix6::identity())).unwrap();
        graph.add_factor(NoSideSlip::new([ids[0], ids[1]], 1.3, [1.0; 4])).unwrap();
        assert!(graph.cost().unwrap() < 1e-20);
    }
}
