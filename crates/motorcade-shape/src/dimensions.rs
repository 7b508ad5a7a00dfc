//! Outer size of a vehicle.

use nalgebra::{Matrix3, Vector3};

/// Length, width, height \[m\].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dimensions {
    /// Bumper to bumper \[m\].
    pub length_m: f64,
    /// Side to side without mirrors \[m\].
    pub width_m: f64,
    /// Road to roof \[m\].
    pub height_m: f64,
}

impl Dimensions {
    /// As a vector (l, w, h) \[m\].
    pub fn to_vector(self) -> Vector3<f64> {
        Vector3::new(self.length_m, self.width_m, self.height_m)
    }
    /// From a vector (l, w, h) \[m\].
    pub fn from_vector(v: &Vector3<f64>) -> Self {
        Self { length_m: v.x, width_m: v.y, height_m: v.z }
    }
}

/// Size prior: mean and standard deviation of a vehicle's class.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SizePrior {
    /// Mean.
    pub mean: Dimensions,
    /// Standard deviation, positive.
    pub sigma: Dimensions,
}

impl SizePrior {
    /// Information matrix (3×3) of (l, w, h), which are independent \[1/m²\].
    pub fn information(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.sigma.to_vector().map(|s| 1.0 / (s * s)))
    }
}
