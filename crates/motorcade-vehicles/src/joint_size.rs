//! The size all frames of a track agree on.

use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Vector3};

use crate::single_view::SingleView;

/// A size and its covariance \[m²\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointSize {
    pub(crate) size: Dimensions,
    pub(crate) covariance: Matrix3<f64>,
}

impl JointSize {
    /// The size all views agree on: each view's normal equations with its place eliminated (Schur complement), summed.
    pub(crate) fn of(views: &[(usize, SingleView)], prior: &SizePrior) -> Option<Self> {
        /// Views count as at most this many independent ones: a detector draws the same car with the same habit every time.
        const INDEPENDENT: f64 = 12.0;
        let weight = (INDEPENDENT / views.len().max(1) as f64).min(1.0);
        let sigma = prior.sigma.to_vector();
        let mut h = Matrix3::from_diagonal(&sigma.map(|s| 1.0 / (s * s)));
        let mut rhs = h * prior.mean.to_vector();
        for (_, view) in views {
            let block = |r: usize, c: usize| view.information.fixed_view::<3, 3>(r, c).into_owned();
            let Some(inverse) = block(0, 0).try_inverse() else { continue };
            let eliminate = block(3, 0) * inverse;
            let reduced = block(3, 3) - eliminate * block(0, 3);
            let g = view.gradient.fixed_rows::<3>(3) - eliminate * view.gradient.fixed_rows::<3>(0);
            h += reduced * weight;
            rhs += (reduced * view.state.fixed_rows::<3>(3) - g) * weight;
        }
        let covariance = h.try_inverse()?;
        // Two and a half sigma of the class at most: a box cut by shadows does not make a two-metre car.
        let size = (covariance * rhs)
            .zip_zip_map(&prior.mean.to_vector(), &sigma, |v, m, s| v.clamp(m - 2.5 * s, m + 2.5 * s));
        Some(Self {
            size: Dimensions::from_vector(&size),
            covariance: (covariance + covariance.transpose()) * 0.5,
        })
    }

    /// Covariance of the proportions, the scale held (3×3).
    pub(crate) fn proportions(&self) -> Matrix3<f64> {
        let d = self.size.to_vector();
        self.covariance - d * d.transpose() * scale_variance(&self.size, &self.covariance)
    }

    /// Information of the size as one frame shows it, its scale held: the proportions are as uncertain as they are, and what one
    /// drawing of a body hides (mirrors, shadows) is a frame's own.
    pub(crate) fn scale_held(&self) -> Option<Matrix3<f64>> {
        /// What the scale is held to: enough to keep the equations regular.
        const HELD: f64 = 0.003;
        let d = self.size.to_vector();
        (self.proportions() + d * d.transpose() * HELD.powi(2)).try_inverse()
    }

    /// Standard deviations, at least 2 cm: sizes of a vehicle's outline mean no more.
    pub(crate) fn as_prior(&self) -> SizePrior {
        let sigma = Vector3::from_fn(|k, _| self.covariance[(k, k)].max(0.0).sqrt().max(0.02));
        SizePrior { mean: self.size, sigma: Dimensions::from_vector(&sigma) }
    }
}

/// Variance of the logarithm of a size's scale: `1 / (dᵀ Σ⁻¹ d)` for a size d of covariance Σ, all proportions kept.
pub(crate) fn scale_variance(size: &Dimensions, covariance: &Matrix3<f64>) -> f64 {
    let d = size.to_vector();
    covariance.try_inverse().map_or(0.0, |information| 1.0 / d.dot(&(information * d)))
}
