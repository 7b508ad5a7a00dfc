//! A frame whose pose is optimised together with the landmarks.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Vector3;

use crate::rolling_shutter::RowMotion;

/// A keyframe of the local map.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Keyframe {
    /// Running number in this segment.
    pub number: usize,
    /// Its pose.
    pub camera_from_world: Pose<Camera, World>,
    /// Motion of the camera while its rows were read.
    pub row_motion: RowMotion,
    /// Length of the baseline to the next keyframe by the road.
    pub baseline: BaselineScale,
    /// The road in its camera's frame, m with `mᵀX = 1`, once one was measured.
    pub plane: Option<Vector3<f64>>,
}

impl Keyframe {
    /// A keyframe without road measurements.
    pub fn new(number: usize, camera_from_world: Pose<Camera, World>, row_motion: RowMotion) -> Self {
        Self { number, camera_from_world, row_motion, baseline: BaselineScale::default(), plane: None }
    }
}

/// Scale of the baseline between two keyframes: weighted mean of the road measurements made along it.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct BaselineScale {
    /// Σ w·ln(height measured / height held) with w = 1/σ².
    sum: f64,
    /// Σ w.
    weight: f64,
    /// Logarithm of the length, once the next keyframe exists.
    log_length: Option<f64>,
}

impl BaselineScale {
    /// Adds the measured camera height over the held one; `sigma` of its logarithm.
    pub fn add(&mut self, log_ratio: f64, sigma: f64) {
        let weight = 1.0 / (sigma * sigma);
        self.sum += weight * log_ratio;
        self.weight += weight;
    }

    /// Ends the baseline: the next keyframe is `length` away, in the unit of the measurements.
    pub fn close(&mut self, length: f64) {
        self.log_length = (self.weight > 0.0 && length > 1e-9).then(|| length.ln() - self.sum / self.weight);
    }

    /// Logarithm of the length and its standard deviation.
    pub fn log_length(&self) -> Option<(f64, f64)> {
        Some((self.log_length?, self.weight.sqrt().recip()))
    }
}
