//! The size that all frames of a track agree on.

use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Vector3};

use crate::box_fit::SingleView;
use crate::options::SizeOptions;

/// A size and its covariance (3×3) \[m²\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointSize {
    pub(crate) size: Dimensions,
    pub(crate) covariance: Matrix3<f64>,
}

impl JointSize {
    /// Sum of each view's normal equations with its position eliminated (Schur complement), and the prior. All views together have
    /// the weight of `independent_views`.
    pub(crate) fn from_views(
        views: &[(usize, SingleView)],
        prior: &SizePrior,
        independent_views: f64,
        options: &SizeOptions,
    ) -> Option<Self> {
        let weight = independent_views / views.len().max(1) as f64;
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
        let limit = options.limit_sigmas;
        let size = (covariance * rhs)
            .zip_zip_map(&prior.mean.to_vector(), &sigma, |v, m, s| v.clamp(m - limit * s, m + limit * s));
        Some(Self {
            size: Dimensions::from_vector(&size),
            covariance: (covariance + covariance.transpose()) * 0.5,
        })
    }

    /// Covariance of the proportions, the scale held (3×3) \[m²\].
    pub(crate) fn proportions(&self) -> Matrix3<f64> {
        let d = self.size.to_vector();
        self.covariance - d * d.transpose() * scale_variance(&self.size, &self.covariance)
    }

    /// Information of the size in one frame with the scale held (3×3): the proportions keep their uncertainty.
    pub(crate) fn information_at_scale(&self, options: &SizeOptions) -> Option<Matrix3<f64>> {
        let d = self.size.to_vector();
        (self.proportions() + d * d.transpose() * options.held_scale_sigma.powi(2)).try_inverse()
    }

    /// The size as a prior with independent dimensions.
    pub(crate) fn as_prior(&self, options: &SizeOptions) -> SizePrior {
        let sigma =
            Vector3::from_fn(|k, _| self.covariance[(k, k)].max(0.0).sqrt().max(options.least_sigma_m));
        SizePrior { mean: self.size, sigma: Dimensions::from_vector(&sigma) }
    }
}

/// Variance of the logarithm of a size's scale: `1 / (dᵀ Σ⁻¹ d)` for a size d of covariance Σ, proportions kept.
pub(crate) fn scale_variance(size: &Dimensions, covariance: &Matrix3<f64>) -> f64 {
    let d = size.to_vector();
    covariance.try_inverse().map_or(0.0, |information| 1.0 / d.dot(&(information * d)))
}
