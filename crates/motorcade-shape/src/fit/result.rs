//! Result of a fit to one image.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix6, Matrix6x3};

use crate::dimensions::Dimensions;

/// Cost difference below which the opposite heading stays possible, −2 ln of 1 %: odds of 100 to 1, the same confidence as the 99 % gate of
/// [`ShapeFit::inliers`]. No option: a fit is asked for its ambiguity where there are none.
pub const CLEAR_COST: f64 = 9.2;

/// Another hypothesis for the same keypoints.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Alternative {
    /// Its pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Its cost, comparable with [`ShapeFit::cost`]: half the difference is the logarithm of the odds.
    pub cost: f64,
    /// True when left and right points are exchanged.
    pub sides_swapped: bool,
}

/// Pose and shape of a vehicle.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ShapeFit {
    /// Pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose (6×6 `[ω, ν]`, right perturbation, so in the vehicle frame), the shape marginalised; the image terms
    /// are inflated where residuals exceed their sigmas.
    pub covariance: Matrix6<f64>,
    /// Covariance of the outer size (length, width, height) \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Cross-covariance of pose and size (6×3): a vehicle that is assumed too small is placed too near.
    pub pose_size_covariance: Matrix6x3<f64>,
    /// Shape coefficients λ, one per used deformation of the prior.
    pub coefficients: Vec<f64>,
    /// Outer size of the shape.
    pub dimensions: Dimensions,
    /// True for measured keypoints within the 99 % gate, in the order of the observation.
    pub inliers: Vec<bool>,
    /// Robust standard deviation of the whitened keypoint residuals: 1 when they are as accurate as assumed.
    pub residual_sigma: f64,
    /// Final robust cost (no factor ½).
    pub cost: f64,
    /// True when the network's left and right points were exchanged.
    pub sides_swapped: bool,
    /// The best hypothesis whose heading differs by more than 90°, if any.
    pub opposite: Option<Alternative>,
    /// Steps of the solver over all hypotheses.
    pub iterations: usize,
}

impl ShapeFit {
    /// Cost difference to the best opposite heading; infinite without one.
    pub fn heading_margin(&self) -> f64 {
        self.opposite.map_or(f64::INFINITY, |o| o.cost - self.cost)
    }
    /// True when the opposite heading is possible (odds under 100 to 1).
    pub fn heading_is_ambiguous(&self) -> bool {
        self.heading_margin() < CLEAR_COST
    }
}
