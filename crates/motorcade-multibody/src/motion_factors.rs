//! Motion of a vehicle: factors on consecutive poses of one vehicle, in its own body frame, so that residuals do not depend on
//! the world's origin.

use motorcade_geometry::lie::se3;
use motorcade_graph::{Factor, GraphError, Terms, Values, VariableId};
use nalgebra::{DMatrixViewMut, DVectorViewMut, Isometry3, Matrix4, Matrix6, SMatrix, SVector};

/// Constant body velocity over three poses (6): `r = log(C⁻¹ B)`, B = V₁⁻¹V₂ the motion over the second interval and
/// `C = exp(ρ log A)` that expected from the first, A = V₀⁻¹V₁, ρ = Δt₂/Δt₁.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct SteadyMotion {
    variables: [VariableId; 3],
    /// ρ.
    interval_ratio: f64,
    information: Matrix6<f64>,
}

impl SteadyMotion {
    /// Over three poses, the second interval `interval_ratio` times as long as the first; standard deviations (6, `[ω, ν]`) of
    /// the motion over the second interval, given the first \[rad, m\].
    pub fn new(variables: [VariableId; 3], interval_ratio: f64, sigmas: [f64; 6]) -> Self {
        Self { variables, interval_ratio, information: information(&sigmas) }
    }

    /// C, and ∂C/∂A (6×6, both tangents on the right); `None` for the identity.
    fn expected(&self, a: &Isometry3<f64>) -> (Isometry3<f64>, Option<Matrix6<f64>>) {
        if self.interval_ratio == 1.0 {
            return (*a, None);
        }
        let twist = se3::log(a);
        let scaled = twist * self.interval_ratio;
        // log(A exp δ) = log A + Jr⁻¹(log A) δ, exp(x + y) = exp(x) exp(Jr(x) y)
        let right = se3::right_jacobian_inverse(&scaled).try_inverse().unwrap_or_else(Matrix6::identity);
        (se3::exp(&scaled), Some(right * self.interval_ratio * se3::right_jacobian_inverse(&twist)))
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
        let (c, dc) = self.expected(&a);
        let e = c.inverse() * b;
        let r = se3::log(&e);
        residual.copy_from(&r);
        if let Some(j) = jacobian {
            let jr = se3::right_jacobian_inverse(&r);
            let ad_b = se3::adjoint(&b.inverse());
            // ∂r/∂V₀ = Jr⁻¹ Ad(E⁻¹) ∂C/∂A Ad(A⁻¹), ∂r/∂V₁ = −Jr⁻¹ (Ad(E⁻¹) ∂C/∂A + Ad(B⁻¹)), ∂r/∂V₂ = Jr⁻¹   (6×6 each)
            let ad_e = se3::adjoint(&e.inverse());
            let (first, second) = match dc {
                // Ad(E⁻¹) Ad(A⁻¹) = Ad(B⁻¹)
                None => (jr * ad_b, ad_e),
                Some(dc) => (jr * ad_e * dc * se3::adjoint(&a.inverse()), ad_e * dc),
            };
            j.view_mut((0, 0), (6, 6)).copy_from(&first);
            j.view_mut((0, 6), (6, 6)).copy_from(&(-jr * (second + ad_b)));
            j.view_mut((0, 12), (6, 6)).copy_from(&jr);
        }
        Ok(())
    }
}

/// Rolling without side slip (4): of the twist `[ω, ν] = log(V₀⁻¹V₁)` roll, pitch and up vanish, and so does the sideways motion of
/// the rear axle, `ν_y − a ω_z` with the axle a behind the vehicle's origin, as in motion along an arc. The middle of a long
/// vehicle does slip in a curve.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct NoSideSlip {
    variables: [VariableId; 2],
    rear_axle_m: f64,
    information: Matrix4<f64>,
}

/// Components of the twist that vanish: roll rate, pitch rate, sideways, up.
const VANISHING: [usize; 4] = [0, 1, 4, 5];
/// Yaw rate.
const YAW: usize = 2;
/// Row of the sideways motion.
const SIDEWAYS: usize = 2;

impl NoSideSlip {
    /// Standard deviations of roll, pitch \[rad\], sideways and up \[m\] over the interval between the poses; distance of the rear
    /// axle behind the origin \[m\].
    pub fn new(variables: [VariableId; 2], rear_axle_m: f64, sigmas: [f64; 4]) -> Self {
        Self { variables, rear_axle_m, information: information(&sigmas) }
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
        for (row, k) in VANISHING.into_iter().enumerate() {
            residual[row] = twist[k];
        }
        residual[SIDEWAYS] -= self.rear_axle_m * twist[YAW];
        if let Some(j) = jacobian {
            let second = se3::right_jacobian_inverse(&twist);
            let first = -second * se3::adjoint(&d.inverse());
            for (row, k) in VANISHING.into_iter().enumerate() {
                let lever = if row == SIDEWAYS { self.rear_axle_m } else { 0.0 };
                j.view_mut((row, 0), (1, 6)).copy_from(&(first.row(k) - first.row(YAW) * lever));
                j.view_mut((row, 6), (1, 6)).copy_from(&(second.row(k) - second.row(YAW) * lever));
            }
        }
        Ok(())
    }
}

/// Information matrix (n×n) of independent errors with these standard deviations (n).
fn information<const N: usize>(sigmas: &[f64; N]) -> SMatrix<f64, N, N> {
    SMatrix::from_diagonal(&SVector::from(*sigmas).map(|sigma| 1.0 / (sigma * sigma)))
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
        for ratio in [1.0, 0.4, 2.5] {
            let steady = SteadyMotion::new([a, b, c], ratio, [1.0; 6]);
            assert!(numeric::jacobian_error(&steady, graph.values()).unwrap() < 1e-6, "{ratio}");
        }
        let rolling = NoSideSlip::new([a, b], 1.3, [0.01, 0.01, 0.05, 0.05]);
        assert!(numeric::jacobian_error(&rolling, graph.values()).unwrap() < 1e-6);
    }

    #[test]
    fn motion_along_an_arc_costs_nothing() {
        let mut graph = Graph::new();
        // The origin lies 1.3 m before the axle, which moves on a circle of 12 m.
        let twist = Vector6::new(0.0, 0.0, 0.1, 1.2, 0.13, 0.0);
        let start = se3::exp(&Vector6::new(0.1, 0.2, 1.0, 4.0, 5.0, 6.0));
        let ids: Vec<_> =
            [0.0, 1.0, 2.0, 4.5].map(|t| graph.add_variable(start * se3::exp(&(twist * t)))).to_vec();
        for (k, ratio) in [1.0, 2.5].into_iter().enumerate() {
            graph.add_factor(SteadyMotion::new([ids[k], ids[k + 1], ids[k + 2]], ratio, [1.0; 6])).unwrap();
        }
        graph.add_factor(NoSideSlip::new([ids[0], ids[1]], 1.3, [1.0; 4])).unwrap();
        assert!(graph.cost().unwrap() < 1e-20);
    }
}
