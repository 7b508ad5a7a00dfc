//! SE(3): rigid motions. Tangent `[ω, ν]`, right perturbation.
//!
//! `exp([ω, ν]) = (exp(ω), Jl(ω) ν)`; formulas from Barfoot, *State Estimation for Robotics*, ch. 8, reordered
//! rotation first.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, Vector3, Vector6};

use super::so3;

fn split(tangent: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (tangent.fixed_rows::<3>(0).into_owned(), tangent.fixed_rows::<3>(3).into_owned())
}

/// Exponential of a tangent `[ω, ν]`.
pub fn exp(tangent: &Vector6<f64>) -> Isometry3<f64> {
    let (w, v) = split(tangent);
    Isometry3::from_parts(Translation3::from(so3::left_jacobian(&w) * v), so3::exp(&w))
}

/// Logarithm `[ω, ν]`, |ω| ≤ π.
pub fn log(pose: &Isometry3<f64>) -> Vector6<f64> {
    let w = so3::log(&pose.rotation);
    let v = so3::left_jacobian_inverse(&w) * pose.translation.vector;
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}

/// Adjoint (6×6): `T exp(δ) T⁻¹ = exp(Ad(T) δ)`. In `[ω, ν]` order `[[R, 0], [t^ R, R]]`.
pub fn adjoint(pose: &Isometry3<f64>) -> Matrix6<f64> {
    let r = pose.rotation.to_rotation_matrix().into_inner();
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&r);
    ad.fixed_view_mut::<3, 3>(3, 0).copy_from(&(so3::hat(&pose.translation.vector) * r));
    ad
}

/// The block Q(ω, ν) of the left Jacobian (Barfoot eq. 8.91).
fn q_block(w: &Vector3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = w.norm_squared();
    let t = t2.sqrt();
    // The closed forms cancel badly below about 0.03 rad; the series' next term is then under 1e-14.
    let (a, b, c) = if t < 0.03 {
        let t4 = t2 * t2;
        (
            1.0 / 6.0 - t2 / 120.0 + t4 / 5040.0,
            1.0 / 24.0 - t2 / 720.0 + t4 / 40320.0,
            1.0 / 120.0 - t2 / 2520.0 + t4 / 120_960.0,
        )
    } else {
        let (s, k) = t.sin_cos();
        let t4 = t2 * t2;
        let b = (t2 + 2.0 * k - 2.0) / (2.0 * t4);
        ((t - s) / (t2 * t), b, (2.0 * t - 3.0 * s + t * k) / (2.0 * t4 * t))
    };
    let (p, r) = (so3::hat(w), so3::hat(v));
    let prp = p * r * p;
    r * 0.5 + (p * r + r * p + prp) * a + (p * p * r + r * p * p - prp * 3.0) * b + (prp * p + p * prp) * c
}

/// Inverse of the left Jacobian (6×6), `[ω, ν]` order: `[[J⁻¹, 0], [−J⁻¹ Q J⁻¹, J⁻¹]]`.
pub fn left_jacobian_inverse(tangent: &Vector6<f64>) -> Matrix6<f64> {
    let (w, v) = split(tangent);
    let j = so3::left_jacobian_inverse(&w);
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&j);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&j);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&-(j * q_block(&w, &v) * j));
    out
}

/// Inverse of the right Jacobian (6×6): `log(T exp(δ)) ≈ log(T) + Jr⁻¹ δ`.
pub fn right_jacobian_inverse(tangent: &Vector6<f64>) -> Matrix6<f64> {
    left_jacobian_inverse(&-tangent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::jacobian_error;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;
    use std::convert::Infallible;

    fn tangent(limit: f64) -> impl Strategy<Value = Vector6<f64>> {
        proptest::array::uniform6(-limit..limit).prop_map(|a| Vector6::from_row_slice(&a))
    }

    proptest! {
        #[test]
        fn log_inverts_exp(a in tangent(1.7)) {
            prop_assert!((log(&exp(&a)) - a).norm() < 1e-11);
        }

        #[test]
        fn adjoint_moves_tangents_across(a in tangent(1.0), d in tangent(0.5)) {
            let t = exp(&a);
            let left = t * exp(&d) * t.inverse();
            prop_assert!((log(&left) - adjoint(&t) * d).norm() < 1e-10);
        }

        #[test]
        fn right_jacobian_inverse_matches_differences(a in tangent(1.5)) {
            let analytic = DMatrix::from_iterator(6, 6, right_jacobian_inverse(&a).iter().copied());
            let error = jacobian_error(&analytic, |step| {
                let moved = log(&(exp(&a) * exp(&step.fixed_rows::<6>(0).into_owned())));
                Ok::<_, Infallible>(DVector::from_column_slice(moved.as_slice()))
            });
            prop_assert!(error.unwrap() < 1e-7);
        }

        #[test]
        fn jacobian_is_smooth_across_the_series_border(a in tangent(1.0)) {
            let unit = a / a.fixed_rows::<3>(0).norm().max(1e-3);
            let below = left_jacobian_inverse(&(unit * 0.029_999_999));
            let above = left_jacobian_inverse(&(unit * 0.030_000_001));
            prop_assert!((below - above).norm() < 1e-7);
        }
    }
}
