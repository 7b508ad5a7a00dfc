//! The size that all frames of a track agree on.

use motorcade_perception::VehicleClass;
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Vector3};

use crate::box_fit::SingleView;
use crate::options::{BoxFitOptions, SizeOptions};
use crate::size_prior::size_prior;

/// A size and its covariance (3×3) \[m²\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointSize {
    pub(crate) size: Dimensions,
    pub(crate) covariance: Matrix3<f64>,
}

/// Rounds in which the scatter of the class grows with the factor.
const ROUNDS: usize = 5;

/// Size of a vehicle by the road alone: its edges and the place where it touches the road, without any prior of its size.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SizeByRoad {
    /// Class that the detector calls it.
    pub class: VehicleClass,
    /// Boxes it was seen in, counted as at most one per correlation time.
    pub views: f64,
    /// Logarithm of the factor on the mean size of that class.
    pub log_factor: f64,
    /// Variance of it: of the boxes and of the road's plane, not of the class.
    pub variance: f64,
    /// Distance to the side of the camera's lane, mean over the boxes \[m\]: the road's level is less known there, and errs alike
    /// in all boxes.
    pub beside_m: f64,
}

impl SizeByRoad {
    /// The factor `f` on the mean size `d` of `class` that explains the views best, where length, width and height scatter about `f·d` by the class's
    /// standard deviations Σ: with the views' information `R` and its right side `r`, `f = dᵀW(R⁻¹r) / dᵀWd` and `W = (R⁻¹ + f²Σ)⁻¹` (generalised least squares). All views together, `views_in_time` of them at
    /// most one per correlation time, have the weight of `independent_views`. `None` when they determine nothing.
    pub(crate) fn from_views(
        views: &[(usize, SingleView)],
        class: VehicleClass,
        views_in_time: f64,
        independent_views: f64,
        options: &BoxFitOptions,
    ) -> Option<Self> {
        let weight = independent_views / views.len().max(1) as f64;
        let (mut information, mut rhs, mut beside) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        let prior = size_prior(class);
        let d = prior.mean.to_vector();
        for (view, (reduced, of_view)) in views.iter().filter_map(|(_, view)| Some((view, reduced(view)?))) {
            information += reduced * weight;
            rhs += of_view * weight;
            beside += d.dot(&(reduced * d)) * weight * options.beside_m(view.state[1]);
        }
        let beside_m = beside / d.dot(&(information * d));
        let mut factor: f64 = 1.0;
        let mut variance = 0.0;
        for _ in 0..ROUNDS {
            let class = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| (factor * s).powi(-2)));
            let gain = class * (class + information).try_inverse()?;
            let weights = gain.transpose() * d;
            let sum = d.dot(&(gain * information * d));
            factor = d.dot(&(gain * rhs)) / sum;
            variance = weights.dot(&(information * weights)) / (sum * sum * factor * factor);
        }
        let log_factor = factor.ln();
        (variance > 0.0 && log_factor.is_finite()).then_some(Self {
            class,
            views: views_in_time,
            log_factor,
            variance,
            beside_m,
        })
    }
}

/// Normal equations of the size (3×3, 3) from one view, its position eliminated by the Schur complement.
fn reduced(view: &SingleView) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let block = |r: usize, c: usize| view.information.fixed_view::<3, 3>(r, c).into_owned();
    let eliminate = block(3, 0) * block(0, 0).try_inverse()?;
    let reduced = block(3, 3) - eliminate * block(0, 3);
    let g = view.gradient.fixed_rows::<3>(3) - eliminate * view.gradient.fixed_rows::<3>(0);
    Some((reduced, reduced * view.state.fixed_rows::<3>(3) - g))
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
        for (reduced, of_view) in views.iter().filter_map(|(_, view)| reduced(view)) {
            h += reduced * weight;
            rhs += of_view * weight;
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
