//! Rauch–Tung–Striebel smoothing of a Kalman filter's forward pass (Rauch, Tung and Striebel, AIAA Journal 1965).
//!
//! ```
//! use motorcade_geometry::rts::{FilterStep, smooth};
//! use nalgebra::{SMatrix, SVector};
//! // A constant, known to 1 before its second measurement and to ½ after it.
//! let one = SMatrix::<f64, 1, 1>::identity();
//! let first = FilterStep {
//!     transition: one, predicted: SVector::zeros(), predicted_covariance: one,
//!     filtered: SVector::zeros(), filtered_covariance: one,
//! };
//! let second = FilterStep { filtered: SVector::repeat(0.5), filtered_covariance: one * 0.5, ..first };
//! let states = smooth(&[first, second]);
//! assert_eq!((states[0].mean[0], states[0].covariance[0]), (0.5, 0.5));
//! ```

use nalgebra::{SMatrix, SVector};

/// One step of the forward pass, state of `N` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterStep<const N: usize> {
    /// F of `x_k = F x_{k−1} + noise`: from the step before to this one (N×N). Not read in the first step.
    pub transition: SMatrix<f64, N, N>,
    /// Mean before this step's measurements.
    pub predicted: SVector<f64, N>,
    /// Covariance before this step's measurements (N×N).
    pub predicted_covariance: SMatrix<f64, N, N>,
    /// Mean after this step's measurements.
    pub filtered: SVector<f64, N>,
    /// Covariance after this step's measurements (N×N).
    pub filtered_covariance: SMatrix<f64, N, N>,
}

/// A state given the measurements of all steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed<const N: usize> {
    /// Mean.
    pub mean: SVector<f64, N>,
    /// Covariance, symmetric (N×N).
    pub covariance: SMatrix<f64, N, N>,
    /// `Cov(x_k, x_{k+1})` (N×N); zero in the last step, and where the next step's prediction is singular.
    pub cross_covariance: SMatrix<f64, N, N>,
}

/// Smooths a forward pass, one state a step. With `G = P_k Fᵀ P̂_{k+1}⁻¹`,
///
/// ```text
/// x̃_k = x_k + G (x̃_{k+1} − x̂_{k+1}),   P̃_k = P_k + G (P̃_{k+1} − P̂_{k+1}) Gᵀ,   Cov(x_k, x_{k+1}) = G P̃_{k+1}
/// ```
///
/// A step whose successor's predicted covariance is singular keeps its filtered state.
pub fn smooth<const N: usize>(steps: &[FilterStep<N>]) -> Vec<Smoothed<N>> {
    smooth_about(&SVector::zeros(), steps)
}

/// [`smooth`] for a filter of deviations from a mean μ (N): the smoothed means are absolute, `μ + x̃_k`.
pub fn smooth_about<const N: usize>(origin: &SVector<f64, N>, steps: &[FilterStep<N>]) -> Vec<Smoothed<N>> {
    let mut out: Vec<Smoothed<N>> = Vec::with_capacity(steps.len());
    for (k, step) in steps.iter().enumerate().rev() {
        let (mut mean, mut covariance) = (step.filtered, step.filtered_covariance);
        let mut cross_covariance = SMatrix::zeros();
        if let (Some(next), Some(ahead)) = (out.last(), steps.get(k + 1))
            && let Some(inverse) = ahead.predicted_covariance.try_inverse()
        {
            let gain = covariance * ahead.transition.transpose() * inverse;
            mean += gain * (next.mean - origin - ahead.predicted);
            covariance += gain * (next.covariance - ahead.predicted_covariance) * gain.transpose();
            cross_covariance = gain * next.covariance;
        }
        out.push(Smoothed {
            mean: mean + origin,
            covariance: (covariance + covariance.transpose()) * 0.5,
            cross_covariance,
        });
    }
    out.reverse();
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

    /// The smoother against the weighted least-squares solution over all states at once.
    #[test]
    fn equals_batch_least_squares() {
        const STEPS: usize = 6;
        let transition = Matrix2::new(1.0, 0.3, 0.0, 0.9);
        let noise = Matrix2::new(0.05, 0.01, 0.01, 0.2);
        let (prior, measured_variance) = (Matrix2::identity() * 4.0, 0.25);
        // Steps 2 and 3 have no measurement of the first component.
        let measurement = |k: usize| (k != 2 && k != 3).then(|| (1.7 * k as f64).sin() + 0.4 * k as f64);

        let (mut x, mut p) = (Vector2::zeros(), prior);
        let mut steps = Vec::new();
        for k in 0..STEPS {
            if k > 0 {
                x = transition * x;
                p = transition * p * transition.transpose() + noise;
            }
            let (predicted, predicted_covariance) = (x, p);
            if let Some(z) = measurement(k) {
                let gain = p.column(0) / (p[(0, 0)] + measured_variance);
                x += gain * (z - x[0]);
                p -= gain * p.row(0);
            }
            let (filtered, filtered_covariance) = (x, p);
            steps.push(FilterStep {
                transition,
                predicted,
                predicted_covariance,
                filtered,
                filtered_covariance,
            });
        }

        let (mut h, mut g) = (DMatrix::zeros(2 * STEPS, 2 * STEPS), DVector::zeros(2 * STEPS));
        let add = |h: &mut DMatrix<f64>, row: usize, column: usize, block: &Matrix2<f64>| {
            let mut view = h.fixed_view_mut::<2, 2>(2 * row, 2 * column);
            view += block;
        };
        add(&mut h, 0, 0, &prior.try_inverse().unwrap());
        let information = noise.try_inverse().unwrap();
        for k in 0..STEPS {
            if k > 0 {
                add(&mut h, k, k, &information);
                add(&mut h, k - 1, k - 1, &(transition.transpose() * information * transition));
                add(&mut h, k, k - 1, &(-information * transition));
                add(&mut h, k - 1, k, &(-transition.transpose() * information));
            }
            if let Some(z) = measurement(k) {
                h[(2 * k, 2 * k)] += 1.0 / measured_variance;
                g[2 * k] += z / measured_variance;
            }
        }
        let origin = Vector2::new(3.0, -1.0);
        for (absolute, state) in smooth_about(&origin, &steps).iter().zip(smooth(&steps)) {
            assert!((absolute.mean - origin - state.mean).norm() < 1e-12);
        }
        let covariance = h.try_inverse().unwrap();
        let mean = &covariance * g;
        for (k, state) in smooth(&steps).iter().enumerate() {
            assert!((state.mean - mean.fixed_rows::<2>(2 * k)).norm() < 1e-9);
            assert!((state.covariance - covariance.fixed_view::<2, 2>(2 * k, 2 * k)).norm() < 1e-9);
            if k + 1 < STEPS {
                let cross = covariance.fixed_view::<2, 2>(2 * k, 2 * k + 2);
                assert!((state.cross_covariance - cross).norm() < 1e-9, "{k}");
            }
        }
    }
}
