//! Errors in units of their covariance.

use nalgebra::{SMatrix, SVector};

/// Squared Mahalanobis length `eᵀ Σ⁻¹ e` of an error (N) with covariance Σ (N×N): for an error of the truth the normalised estimation
/// error squared (NEES), χ² with N degrees of freedom when Σ is right. `None` when Σ is not positive definite.
pub fn mahalanobis_squared<const N: usize>(
    error: &SVector<f64, N>,
    covariance: &SMatrix<f64, N, N>,
) -> Option<f64> {
    Some(error.dot(&covariance.cholesky()?.solve(error)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn correlated_errors_are_whitened() {
        let covariance = Matrix2::new(2.0, 1.0, 1.0, 2.0);
        // Eigenvalues 3 along (1, 1) and 1 along (1, −1).
        let length = |x: f64, y: f64| mahalanobis_squared(&Vector2::new(x, y), &covariance).unwrap();
        assert!((length(1.0, 1.0) - 2.0 / 3.0).abs() < 1e-12);
        assert!((length(1.0, -1.0) - 2.0).abs() < 1e-12);
        assert_eq!(mahalanobis_squared(&Vector2::x(), &Matrix2::zeros()), None);
    }
}
