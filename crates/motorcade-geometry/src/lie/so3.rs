//! SO(3): rotations. Formulas: Solà et al., *A micro Lie theory*, arXiv 1812.01537, eqs. 131–146.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Below this angle \[rad\] series replace the closed forms (their error is then under 1e-16).
const SMALL_RAD: f64 = 1e-4;

/// The 3×3 matrix with `hat(w) v = w × v`.
pub fn hat(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// Rotation by |w| radians about w.
pub fn exp(w: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = w.norm();
    let half = 0.5 * angle;
    let sinc = if angle < SMALL_RAD { 0.5 - angle * angle / 48.0 } else { half.sin() / angle };
    UnitQuaternion::new_normalize(Quaternion::new(half.cos(), sinc * w.x, sinc * w.y, sinc * w.z))
}

/// Inverse of [`exp`], |w| ≤ π.
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (mut w, mut v) = (q.w, Vector3::new(q.i, q.j, q.k));
    if w < 0.0 {
        w = -w;
        v = -v;
    }
    let n = v.norm();
    // atan2 keeps its precision near 0 and near π alike.
    let factor = if n < SMALL_RAD { 2.0 / w - 2.0 * n * n / (3.0 * w * w * w) } else { 2.0 * n.atan2(w) / n };
    v * factor
}

/// Right Jacobian (3×3): `exp(w + δ) ≈ exp(w) · exp(Jr(w) δ)`.
pub fn right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian(&-w)
}

/// Left Jacobian (3×3): `exp(w + δ) ≈ exp(Jl(w) δ) · exp(w)`.
pub fn left_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = w.norm_squared();
    let t = t2.sqrt();
    let (a, b) = if t < SMALL_RAD {
        (0.5 - t2 / 24.0, 1.0 / 6.0 - t2 / 120.0)
    } else {
        ((1.0 - t.cos()) / t2, (t - t.sin()) / (t2 * t))
    };
    let h = hat(w);
    Matrix3::identity() + h * a + h * h * b
}

/// Inverse of [`left_jacobian`].
pub fn left_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = w.norm_squared();
    let t = t2.sqrt();
    let c = if t < SMALL_RAD {
        1.0 / 12.0 + t2 / 720.0
    } else {
        let half = 0.5 * t;
        (1.0 - half * half.cos() / half.sin()) / t2
    };
    let h = hat(w);
    Matrix3::identity() - h * 0.5 + h * h * c
}

/// Inverse of [`right_jacobian`].
pub fn right_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian_inverse(&-w)
}

/// The rotation matrix nearest to `m` in the Frobenius norm; the identity when `m` has no finite decomposition.
pub fn nearest(m: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = m.svd(true, true);
    let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let det = (u * vt).determinant();
    u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, det.signum())) * vt
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::jacobian_error;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;
    use std::convert::Infallible;

    fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
        proptest::array::uniform3(-limit..limit).prop_map(|a| Vector3::new(a[0], a[1], a[2]))
    }

    proptest! {
        #[test]
        fn log_inverts_exp(w in vector(1.8)) {
            prop_assert!((log(&exp(&w)) - w).norm() < 1e-12);
        }

        #[test]
        fn tiny_angles_keep_their_digits(w in vector(1e-5)) {
            prop_assert!((log(&exp(&w)) - w).norm() < 1e-18);
        }

        #[test]
        fn jacobians_match_differences(w in vector(1.5)) {
            let analytic = DMatrix::from_iterator(3, 3, right_jacobian(&w).iter().copied());
            let error = jacobian_error(&analytic, |step| {
                let moved = log(&(exp(&w).inverse() * exp(&(w + step.fixed_rows::<3>(0)))));
                Ok::<_, Infallible>(DVector::from_column_slice(moved.as_slice()))
            });
            prop_assert!(error.unwrap() < 1e-7);
            prop_assert!((right_jacobian(&w) * right_jacobian_inverse(&w) - Matrix3::identity()).norm() < 1e-12);
        }
    }

    #[test]
    fn half_turn_survives() {
        let w = Vector3::new(0.0, std::f64::consts::PI - 1e-9, 0.0);
        assert!((log(&exp(&w)) - w).norm() < 1e-12);
    }
}
