//! Between g2o's order (translation first) and ours (rotation first).

use nalgebra::{Matrix3, Matrix6};

/// Both ways: swaps the two halves of a 6×6 matrix.
pub(super) fn swap_halves(m: &Matrix6<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| m[((i + 3) % 6, (j + 3) % 6)])
}

/// `[x, y, θ]` to `[θ, x, y]`.
pub(super) fn angle_first(m: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| m[((i + 2) % 3, (j + 2) % 3)])
}

/// `[θ, x, y]` to `[x, y, θ]`.
pub(super) fn angle_last(m: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| m[((i + 1) % 3, (j + 1) % 3)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_inverse_to_each_other() {
        let m = Matrix3::from_fn(|i, j| (3 * i + j) as f64);
        assert_eq!(angle_last(&angle_first(&m)), m);
        assert_eq!(angle_first(&m)[(0, 0)], 8.0);
        let m = Matrix6::from_fn(|i, j| (6 * i + j) as f64);
        assert_eq!(swap_halves(&swap_halves(&m)), m);
        assert_eq!(swap_halves(&m)[(0, 3)], m[(3, 0)]);
    }
}
