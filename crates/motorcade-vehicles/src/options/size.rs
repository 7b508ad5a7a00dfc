//! Options of the size shared by the frames of a track.

use motorcade_perception::VehicleClass;
use motorcade_shape::{Dimensions, SizePrior};

use crate::size_prior::size_prior;

/// Weight and limits of the size that the boxes of a track agree on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SizeOptions {
    /// False places each box by the prior of its class: the frames of a track agree on no size.
    pub shared: bool,
    /// Factor on the standard deviations of the size of a class, when a vehicle is placed. Chosen: 1, the spread of the class; with 10 the height
    /// of a box says nothing on its distance, which is then left to ground contact and keypoints.
    pub prior_factor: f64,
    /// Views count as at most this many independent ones: a detector draws the same vehicle with the same bias every time.
    pub independent_views: f64,
    /// Largest deviation from the class mean, in its standard deviations: a box truncated by shadows must not shrink a car.
    pub limit_sigmas: f64,
    /// Standard deviation of the logarithm of the scale while the scale is held: small, but large enough for regular equations.
    pub held_scale_sigma: f64,
    /// Smallest standard deviation of a dimension \[m\]: the outline of a vehicle is not known better.
    pub least_sigma_m: f64,
}

impl Default for SizeOptions {
    fn default() -> Self {
        Self {
            shared: true,
            prior_factor: 1.0,
            independent_views: 12.0,
            limit_sigmas: 2.5,
            held_scale_sigma: 0.003,
            least_sigma_m: 0.02,
        }
    }
}

impl SizeOptions {
    /// The size prior by which a vehicle of a class is placed.
    pub(crate) fn prior(&self, class: VehicleClass) -> SizePrior {
        let SizePrior { mean, sigma } = size_prior(class);
        let sigma = sigma.to_vector() * self.prior_factor;
        SizePrior { mean, sigma: Dimensions::from_vector(&sigma) }
    }
}
