//! The relative pose of two SE(3) variables.

use motorcade_geometry::lie::so3;
use nalgebra::{DMatrixView, DMatrixViewMut, DVectorViewMut, Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::blocks::{LowerBlocks, Symmetric, join, put};
use crate::GraphError;
use crate::factor::{Factor, Normal, RelativePose};
use crate::information;
use crate::values::{Values, VariableId};

/// How the error motion `E = Z⁻¹ Xi⁻¹ Xj` becomes six numbers, rotation first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseResidual {
    /// `log(E) = [ω, ν]` (GTSAM).
    #[default]
    Log,
    /// `[q_xyz, t]` of E with q_w ≥ 0 (g2o).
    Mqt,
}

/// Measured motion `Z = first_from_second` between two poses `X = world_from_body`.
///
/// ```text
/// E   = Z⁻¹ Xi⁻¹ Xj                       r = log(E) or [q_xyz(E), t(E)]     (6)
/// J_j = ∂r/∂δ_j = Jr⁻¹(r)                 or [[½(q_w I + q^), 0], [0, R_E]]   (6×6)
/// J_i = ∂r/∂δ_i = −J_j · Ad(Xj⁻¹ Xi)                                          (6×6)
/// ```
///
/// H needs one congruence `A = J_jᵀ Ω J_j` and the adjoint: `H_jj = A`, `H_ji = −A·Ad`, `H_ii = Adᵀ·A·Ad`.
#[derive(Clone, Debug)]
pub struct Between {
    variables: [VariableId; 2],
    measurement: Isometry3<f64>,
    information: Matrix6<f64>,
    residual: PoseResidual,
}

/// Residual and the block-triangular J_j.
struct Linearised {
    r: (Vector3<f64>, Vector3<f64>),
    jacobian: LowerBlocks,
}

impl Between {
    /// A measurement of `first_from_second` with information Ω in `[ω, ν]` order, which must be symmetric positive
    /// semidefinite.
    pub fn new(
        first: VariableId,
        second: VariableId,
        measurement: Isometry3<f64>,
        information: Matrix6<f64>,
    ) -> Result<Self, GraphError> {
        information::check(DMatrixView::from_slice(information.as_slice(), 6, 6))?;
        Ok(Self { variables: [first, second], measurement, information, residual: PoseResidual::Log })
    }

    /// The same with another residual.
    #[must_use]
    pub fn with_residual(self, residual: PoseResidual) -> Self {
        Self { residual, ..self }
    }

    /// Ω scaled.
    pub fn scale_information(&mut self, factor: f64) {
        self.information *= factor;
    }

    #[inline]
    fn error(&self, second_from_first: &Isometry3<f64>) -> Isometry3<f64> {
        // E = Z⁻¹ (Xj⁻¹ Xi)⁻¹
        (second_from_first * self.measurement).inverse()
    }

    #[inline]
    fn residual_of(&self, e: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        match self.residual {
            PoseResidual::Log => {
                let w = so3::log(&e.rotation);
                (w, log_translation(&w, &e.translation.vector))
            }
            PoseResidual::Mqt => {
                let q = e.rotation.quaternion();
                let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
                (sign * q.imag(), e.translation.vector)
            }
        }
    }

    #[inline]
    fn linearise(&self, e: &Isometry3<f64>) -> Linearised {
        let r = self.residual_of(e);
        let jacobian = match self.residual {
            PoseResidual::Log => log_jacobian(&r.0, &r.1),
            PoseResidual::Mqt => LowerBlocks {
                a: (Matrix3::identity() * e.rotation.quaternion().w.abs() + so3::hat(&r.0)) * 0.5,
                b: Matrix3::zeros(),
                c: e.rotation.to_rotation_matrix().into_inner(),
            },
        };
        Linearised { r, jacobian }
    }

    #[inline]
    fn second_from_first(&self, values: &Values) -> Result<Isometry3<f64>, GraphError> {
        let [i, j] = self.variables;
        Ok(values.get::<Isometry3<f64>>(j)?.inv_mul(values.get::<Isometry3<f64>>(i)?))
    }
}

/// `Jl⁻¹(ω) t` without forming the matrix.
#[inline]
fn log_translation(w: &Vector3<f64>, t: &Vector3<f64>) -> Vector3<f64> {
    let wt = w.cross(t);
    t - wt * 0.5 + w.cross(&wt) * so3_inverse_coefficient(w.norm_squared())
}

/// c of `Jl⁻¹ = I − ½ω^ + c ω^ω^`.
#[inline]
fn so3_inverse_coefficient(t2: f64) -> f64 {
    if t2 < 1e-6 {
        return 1.0 / 12.0 + t2 / 720.0;
    }
    let half = 0.5 * t2.sqrt();
    (1.0 - half * half.cos() / half.sin()) / t2
}

/// `Jr⁻¹` of SE(3) at `[ω, ν]` as blocks: `[[J, 0], [−J Q J, J]]` with `J = I + ½ω^ + c ω^ω^` and Barfoot's Q at
/// (−ω, −ν). With `P = ω^`, `N = ν^`, `s = ω·ν`: `PNP = −s P`, so Q is a sum of P, N, PN + NP and PPN + NPP alone.
#[inline]
fn log_jacobian(w: &Vector3<f64>, v: &Vector3<f64>) -> LowerBlocks {
    let t2 = w.norm_squared();
    let outer = |x: &Vector3<f64>, y: &Vector3<f64>| x * y.transpose();
    let p = so3::hat(w);
    // ω^ω^ = ωωᵀ − |ω|² I
    let j = Matrix3::identity() * (1.0 - t2 * so3_inverse_coefficient(t2))
        + p * 0.5
        + outer(w, w) * so3_inverse_coefficient(t2);
    let (a, b, c) = q_coefficients(t2);
    let s = w.dot(v);
    // PN + NP = ωνᵀ + νωᵀ − 2s I,  PPN + NPP = −|ω|² N − s P,  PNPP + PPNP = −2s PP
    let mixed = outer(w, v) + outer(v, w) - Matrix3::identity() * (2.0 * s);
    let pp = outer(w, w) - Matrix3::identity() * t2;
    let odd = so3::hat(v) * (0.5 - b * t2) + p * (s * (2.0 * b - a));
    let q = mixed * a - odd - pp * (2.0 * c * s);
    LowerBlocks { a: j, b: -(j * q * j), c: j }
}

/// Coefficients of Barfoot eq. 8.91 as in `motorcade_geometry::lie::se3`.
#[inline]
fn q_coefficients(t2: f64) -> (f64, f64, f64) {
    let t4 = t2 * t2;
    if t2 < 0.0009 {
        return (
            1.0 / 6.0 - t2 / 120.0 + t4 / 5040.0,
            1.0 / 24.0 - t2 / 720.0 + t4 / 40320.0,
            1.0 / 120.0 - t2 / 2520.0 + t4 / 120_960.0,
        );
    }
    let t = t2.sqrt();
    let (s, k) = t.sin_cos();
    ((t - s) / (t2 * t), (t2 + 2.0 * k - 2.0) / (2.0 * t4), (2.0 * t - 3.0 * s + t * k) / (2.0 * t4 * t))
}

#[inline]
fn adjoint(pose: &Isometry3<f64>) -> LowerBlocks {
    let r = pose.rotation.to_rotation_matrix().into_inner();
    LowerBlocks { a: r, b: so3::hat(&pose.translation.vector) * r, c: r }
}

impl Factor for Between {
    fn variables(&self) -> &[VariableId] {
        &self.variables
    }

    fn dim(&self) -> usize {
        6
    }

    fn information(&self) -> DMatrixView<'_, f64> {
        DMatrixView::from_slice(self.information.as_slice(), 6, 6)
    }

    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let d = self.second_from_first(values)?;
        let e = self.error(&d);
        let Some(jacobian) = jacobian else {
            let r = self.residual_of(&e);
            residual.copy_from(&join(&r.0, &r.1));
            return Ok(());
        };
        let at = self.linearise(&e);
        residual.copy_from(&join(&at.r.0, &at.r.1));
        jacobian.view_mut((0, 6), (6, 6)).copy_from(&at.jacobian.to_matrix());
        jacobian.view_mut((0, 0), (6, 6)).copy_from(&-at.jacobian.mul(&adjoint(&d)).to_matrix());
        Ok(())
    }

    fn squared_norm(&self, values: &Values) -> Result<f64, GraphError> {
        let r = self.residual_of(&self.error(&self.second_from_first(values)?));
        let r: Vector6<f64> = join(&r.0, &r.1);
        Ok(r.dot(&(self.information * r)))
    }

    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        let d = self.second_from_first(values)?;
        let Linearised { r, jacobian } = self.linearise(&self.error(&d));
        let information = Symmetric::from_matrix(&self.information);
        let (wx, wy) = information.times(&r.0, &r.1);
        let s = r.0.dot(&wx) + r.1.dot(&wy);
        let a = jacobian.congruence(&jacobian.after(&information));
        let (gx, gy) = jacobian.tr_mul(&wx, &wy);
        let ad = adjoint(&d);
        let a_ad = ad.after(&a);
        let ii = ad.congruence(&a_ad);
        let (fx, fy) = ad.tr_mul(&gx, &gy);
        let Some(g) = out.g_mut().first_chunk_mut::<12>() else {
            return Err(GraphError::Size { what: "tangent of two poses", expected: 12, found: out.size() });
        };
        for k in 0..3 {
            (g[k], g[3 + k], g[6 + k], g[9 + k]) = (-fx[k], -fy[k], gx[k], gy[k]);
        }
        let Some(h) = out.h_mut().first_chunk_mut::<144>() else {
            return Err(GraphError::Size { what: "tangent of two poses", expected: 12, found: 0 });
        };
        put(h, 0, 0, &ii.p, 1.0);
        put(h, 3, 0, &ii.q, 1.0);
        put(h, 3, 3, &ii.s, 1.0);
        put(h, 6, 0, &a_ad[0], -1.0);
        put(h, 6, 3, &a_ad[1], -1.0);
        put(h, 9, 0, &a_ad[2], -1.0);
        put(h, 9, 3, &a_ad[3], -1.0);
        put(h, 6, 6, &a.p, 1.0);
        put(h, 9, 6, &a.q, 1.0);
        put(h, 9, 9, &a.s, 1.0);
        Ok(s)
    }

    fn relative_pose(&self) -> Option<RelativePose<'_>> {
        Some(RelativePose { measurement: &self.measurement, information: &self.information })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::lie::se3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn block_jacobian_is_the_one_of_the_group(a in proptest::array::uniform6(-1.8..1.8), small in 1e-4..1.0) {
            let w = Vector3::new(a[0], a[1], a[2]) * small;
            let v = Vector3::new(a[3], a[4], a[5]);
            let expected = se3::right_jacobian_inverse(&join(&w, &v));
            prop_assert!((log_jacobian(&w, &v).to_matrix() - expected).norm() < 1e-11);
        }
    }
}
