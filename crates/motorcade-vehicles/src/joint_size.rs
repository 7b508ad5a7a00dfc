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
    /// The factor on the mean size of `class` that explains the views best. All views together, `views_in_time` of them at
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
        let (log_factor, variance) = factor(&prior, &information, &rhs)?;
        Some(Self { class, views: views_in_time, log_factor, variance, beside_m })
    }
}

/// Logarithm of the factor `f` on the mean size `d` of a prior that explains normal equations `R·size = r` best, and the variance it has by them. Length,
/// width and height scatter about `f·d` by the prior's standard deviations Σ, and are weighed by generalised least squares:
/// `f = dᵀW(R⁻¹r) / dᵀWd` with `W = (R⁻¹ + f²Σ)⁻¹`. `None` where they determine nothing.
fn factor(prior: &SizePrior, information: &Matrix3<f64>, rhs: &Vector3<f64>) -> Option<(f64, f64)> {
    let d = prior.mean.to_vector();
    let (mut factor, mut variance) = (1.0_f64, 0.0);
    for _ in 0..ROUNDS {
        let class = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| (factor * s).powi(-2)));
        // W = gain · R, also where R has no inverse.
        let gain = class * (class + information).try_inverse()?;
        let weights = gain.transpose() * d;
        let sum = weights.dot(&(information * d));
        factor = weights.dot(rhs) / sum;
        variance = weights.dot(&(information * weights)) / (sum * sum * factor * factor);
    }
    let log_factor = factor.ln();
    (variance > 0.0 && log_factor.is_finite()).then_some((log_factor, variance))
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
        let mut h = prior.information();
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

    /// The same size with the error of the level of the ground beside the lane, which all views share, in the variance of its scale: as far as ground contact
    /// tells it beyond the class (`prior`). The camera is `height_m` above the road.
    pub(crate) fn with_level(
        self,
        views: &[(usize, SingleView)],
        prior: &SizePrior,
        height_m: f64,
        options: &BoxFitOptions,
    ) -> Self {
        let count = views.len().max(1) as f64;
        let level_m = views.iter().map(|(_, view)| options.level_sigma_m(view.state[1])).sum::<f64>() / count;
        let class = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| s * s));
        let (own, of_class) =
            (scale_variance(&self.size, &self.covariance), scale_variance(&prior.mean, &class));
        let by_ground = (1.0 - own / of_class).clamp(0.0, 1.0);
        let sigma = (by_ground * level_m / height_m).min(of_class.sqrt());
        let d = self.size.to_vector();
        Self { covariance: self.covariance + d * d.transpose() * (sigma * sigma), ..self }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::box_fit::BoxFit;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, track_of};

    /// A car of the size of its class, by ground contact alone and by its class alone, on the own lane and beside it.
    #[test]
    fn a_size_by_ground_contact_is_as_unsure_as_the_level_beside_the_lane() {
        let (prior, options, grounds) =
            (size_prior(VehicleClass::Car), BoxFitOptions::default(), level_grounds(1));
        let widened = |left_m: f64, sigma: f64| {
            let car = track_of(&car_ahead(1, -left_m, 20.0), [true; 4]);
            let fit = BoxFit { camera: &CAMERA, ground: &grounds[0], options: &options };
            let view = fit.locate(&car.boxes[0].observed, 0.0, &prior).unwrap();
            let covariance = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| (sigma * s).powi(2)));
            let own = JointSize { size: prior.mean, covariance };
            let found = own.with_level(&[(0, view)], &prior, 1.5, &options).covariance;
            (scale_variance(&prior.mean, &found) - scale_variance(&prior.mean, &covariance)).sqrt()
        };
        assert!(widened(0.0, 0.1) < 1e-6 && widened(6.0, 1.0) < 1e-6);
        let level = options.level_sigma_m(3.0) / 1.5;
        assert!((0.95 * level..level).contains(&widened(3.0, 0.1)), "{} {level}", widened(3.0, 0.1));
        // The scatter of the class is the largest deviation.
        let class = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| s * s));
        let most = scale_variance(&prior.mean, &class).sqrt();
        assert!((widened(9.0, 0.1) - most).abs() < 1e-6, "{} {most}", widened(9.0, 0.1));
    }

    #[test]
    fn all_dimensions_tell_the_factor() {
        let prior = size_prior(VehicleClass::Car);
        let d = prior.mean.to_vector();
        let told = |by: Vector3<f64>, sigma: [f64; 3]| {
            let information = Matrix3::from_diagonal(&Vector3::from(sigma.map(|s: f64| 1.0 / (s * s))));
            factor(&prior, &information, &(information * d.component_mul(&by)))
        };
        let even = told(Vector3::repeat(1.3), [0.3, 0.05, 0.05]).unwrap();
        assert!((even.0 - 1.3_f64.ln()).abs() < 1e-6 && (0.0..0.001).contains(&even.1), "{even:?}");
        // A tall car whose height is known to a centimetre: its width counts no less, as cars scatter by more.
        let tall = told(Vector3::new(1.0, 1.03, 1.14), [10.0, 0.05, 0.01]).unwrap();
        assert!((0.07..0.09).contains(&tall.0), "{tall:?}");
        assert!(factor(&prior, &Matrix3::zeros(), &Vector3::zeros()).is_none());
    }
}
