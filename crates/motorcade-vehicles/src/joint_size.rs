//! The size that all frames of a track agree on.

use motorcade_perception::VehicleClass;
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};

use crate::box_fit::SingleView;
use crate::options::{BoxFitOptions, SizeOptions};
use crate::size_prior::size_prior;

/// Smallest standard deviation of the road's level \[m\]: on the own lane it is that of the plane, which each frame has.
const LEAST_LEVEL_SIGMA_M: f64 = 1e-4;

/// A size and its covariance (3×3) \[m²\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointSize {
    pub(crate) size: Dimensions,
    pub(crate) covariance: Matrix3<f64>,
}

/// Size of a vehicle by the road alone: its edges and the place where it touches the road, without any prior of its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeByRoad {
    /// Class that the detector calls it.
    pub class: VehicleClass,
    /// Boxes it was seen in.
    pub views: usize,
    /// Logarithm of the factor on the mean size of that class.
    pub log_factor: f64,
    /// Variance of it: of the boxes and of the road's plane, not of the class.
    pub variance: f64,
    /// Distance to the side of the camera's lane, mean over the boxes \[m\]: the road's level is less known there, and errs alike
    /// in all boxes.
    pub beside_m: f64,
}

impl SizeByRoad {
    /// The factor on the mean size of `class` that explains the views best. All views together have the weight of `independent_views`. `None` when
    /// they tell nothing.
    pub(crate) fn from_views(
        views: &[(usize, SingleView)],
        class: VehicleClass,
        independent_views: f64,
        options: &BoxFitOptions,
    ) -> Option<Self> {
        let weight = independent_views / views.len().max(1) as f64;
        let d = size_prior(class).mean.to_vector();
        let (mut information, mut gradient, mut beside) = (0.0, 0.0, 0.0);
        for (view, (reduced, rhs)) in views.iter().filter_map(|(_, view)| Some((view, reduced(view)?))) {
            let own = d.dot(&(reduced * d)) * weight;
            information += own;
            gradient += d.dot(&(rhs - reduced * d)) * weight;
            beside += own * options.beside_m(view.state[1]);
        }
        let log_factor = (1.0 + gradient / information).ln();
        (information > 0.0 && log_factor.is_finite()).then(|| Self {
            class,
            views: views.len(),
            log_factor,
            variance: 1.0 / information,
            beside_m: beside / information,
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

/// Normal equations of the size and the road's level (4×4, 4) from one view, its position eliminated by the Schur complement. The height
/// of the road is then level and an error of the frame's own.
fn reduced_with_level(view: &SingleView) -> Option<(Matrix4<f64>, Vector4<f64>)> {
    let (own, both) = (view.road_height.own_m.powi(-2), 1.0 / view.road_height.variance());
    let mut position = view.information.fixed_view::<3, 3>(0, 0).into_owned();
    position[(2, 2)] += own - both;
    let mut gradient = view.gradient.fixed_rows::<3>(0).into_owned();
    gradient[2] += (own - both) * view.state[2];
    let mut coupling = Matrix3x4::zeros();
    coupling.fixed_view_mut::<3, 3>(0, 0).copy_from(&view.information.fixed_view::<3, 3>(0, 3));
    coupling[(2, 3)] = -own;
    let mut h = Matrix4::zeros();
    h.fixed_view_mut::<3, 3>(0, 0).copy_from(&view.information.fixed_view::<3, 3>(3, 3));
    h[(3, 3)] = own;
    let size = view.state.fixed_rows::<3>(3);
    let of_size = view.gradient.fixed_rows::<3>(3);
    let mut g = Vector4::new(of_size[0], of_size[1], of_size[2], -own * view.state[2]);
    let eliminate = coupling.transpose() * position.try_inverse()?;
    h -= eliminate * coupling;
    g -= eliminate * gradient;
    // At a level of zero.
    Some((h, h * Vector4::new(size[0], size[1], size[2], 0.0) - g))
}

impl JointSize {
    /// Sum of each view's normal equations with its position eliminated (Schur complement), and the priors of the size and of the
    /// road's level under the vehicle, an error that all its views share. All views together have the weight of `independent_views`.
    pub(crate) fn from_views(
        views: &[(usize, SingleView)],
        prior: &SizePrior,
        independent_views: f64,
        options: &SizeOptions,
    ) -> Option<Self> {
        let weight = independent_views / views.len().max(1) as f64;
        let sigma = prior.sigma.to_vector();
        let (mut h, mut rhs) = (Matrix4::zeros(), Vector4::zeros());
        for (reduced, of_view) in views.iter().filter_map(|(_, view)| reduced_with_level(view)) {
            h += reduced * weight;
            rhs += of_view * weight;
        }
        let level_m = views.iter().map(|(_, view)| view.road_height.common_m).sum::<f64>() * weight;
        h[(3, 3)] += (level_m / independent_views).max(LEAST_LEVEL_SIGMA_M).powi(-2);
        for k in 0..3 {
            h[(k, k)] += sigma[k].powi(-2);
            rhs[k] += sigma[k].powi(-2) * prior.mean.to_vector()[k];
        }
        let covariance = h.try_inverse()?;
        let limit = options.limit_sigmas;
        let size =
            (covariance * rhs).fixed_rows::<3>(0).zip_zip_map(&prior.mean.to_vector(), &sigma, |v, m, s| {
                v.clamp(m - limit * s, m + limit * s)
            });
        let covariance = covariance.fixed_view::<3, 3>(0, 0).into_owned();
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
