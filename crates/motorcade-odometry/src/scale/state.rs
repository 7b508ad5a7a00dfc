//! Values of the smoother.

use motorcade_geometry::robust::{median, sigma_from_absolute};
use nalgebra::{Matrix3, Vector3};

use super::options::SmootherOptions;

/// Places of variances in a covariance of [`ScaleAndTilt::to_vector`].
pub(super) const OF_LOG_SCALE: (usize, usize) = (0, 0);
pub(super) const OF_PITCH: (usize, usize) = (1, 1);
pub(super) const OF_ROLL: (usize, usize) = (2, 2);

/// Scale of the odometry and tilt of the road in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ScaleAndTilt {
    /// Logarithm of the metres per unit of the odometry, s.
    pub log_scale: f64,
    /// Pitch of the road relative to the camera \[rad\].
    pub pitch_rad: f64,
    /// Roll of the road relative to the camera \[rad\].
    pub roll_rad: f64,
}

impl ScaleAndTilt {
    /// From `[log s, pitch, roll]`.
    pub fn from_vector(v: &Vector3<f64>) -> Self {
        Self { log_scale: v.x, pitch_rad: v.y, roll_rad: v.z }
    }

    /// `[log s, pitch, roll]`.
    pub fn to_vector(self) -> Vector3<f64> {
        Vector3::new(self.log_scale, self.pitch_rad, self.roll_rad)
    }
}

/// Motion from the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interval {
    /// Distance travelled \[camera heights\].
    pub travelled: f64,
    /// Time \[0.1 s\].
    pub elapsed: f64,
}

/// A measurement at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StateMeasurement {
    /// Frame it belongs to.
    pub frame: usize,
    /// Measured scale and tilt.
    pub value: ScaleAndTilt,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
    /// True for the road; a distance by another sensor measures log s alone.
    pub of_road: bool,
}

impl StateMeasurement {
    /// A measurement of log s alone.
    pub(super) fn of_scale(frame: usize, log_scale: f64, variance: f64) -> Self {
        let value = ScaleAndTilt { log_scale, ..ScaleAndTilt::default() };
        let covariance = Matrix3::from_diagonal(&Vector3::new(variance, NOTHING, NOTHING));
        Self { frame, value, covariance, of_road: false }
    }
}

/// Variance of a tilt that was not measured \[rad²\].
const NOTHING: f64 = 1e6;

/// Smoothed state of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SmoothedState {
    /// Estimated scale and tilt.
    pub value: ScaleAndTilt,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
    /// Correlation of the error of log s with that of the frame before, 0 to 1.
    pub correlation: f64,
    /// Number of neighbouring measurements that count as one in the covariance of log s.
    pub overlap: f64,
}

/// Noise of a drive, estimated from the drive itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// Drift of log s per √(camera height travelled).
    pub drift: f64,
    /// Standard deviation of log s of a single frame beyond its pixels: heave of the body, unevenness of the road.
    pub height_sigma: f64,
    /// Mean pitch and roll \[rad\].
    pub mean_tilt: [f64; 2],
    /// Standard deviations of pitch and roll about it \[rad\].
    pub tilt_sigma: [f64; 2],
}

impl NoiseModel {
    /// Mean and spread of the tilt; no drift. Without a measurement of the road it is level to `unknown_rad`; `None` without any
    /// measurement.
    pub(super) fn of_tilt(
        measurements: &[StateMeasurement],
        unknown_rad: f64,
        options: &SmootherOptions,
    ) -> Option<Self> {
        let least = options.least_tilt_sigma_rad;
        let of = |angle: fn(&ScaleAndTilt) -> f64| -> Option<(f64, f64)> {
            let own = measurements.iter().filter(|m| m.of_road);
            let mut values: Vec<f64> = own.map(|m| angle(&m.value)).collect();
            let mean = median(&mut values)?;
            let mut absolute: Vec<f64> = values.iter().map(|v| (v - mean).abs()).collect();
            Some((mean, sigma_from_absolute(&mut absolute)?.clamp(least, options.tilt_sigma_range * least)))
        };
        let level = (0.0, unknown_rad);
        let (pitch, pitch_sigma) = of(|state| state.pitch_rad).unwrap_or(level);
        let (roll, roll_sigma) = of(|state| state.roll_rad).unwrap_or(level);
        let model = Self {
            drift: 0.0,
            height_sigma: 0.0,
            mean_tilt: [pitch, roll],
            tilt_sigma: [pitch_sigma, roll_sigma],
        };
        (!measurements.is_empty()).then_some(model)
    }

    /// Mean of the state; the scale has none.
    pub(super) fn mean(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.mean_tilt[0], self.mean_tilt[1])
    }

    /// Transition over an interval and its noise: a random walk of log s per distance, a first-order autoregression of the tilt
    /// in time.
    pub(super) fn transition(
        &self,
        interval: &Interval,
        options: &SmootherOptions,
    ) -> (Matrix3<f64>, Matrix3<f64>) {
        let correlation = options.tilt_correlation.powf(interval.elapsed);
        let innovation = 1.0 - correlation * correlation;
        let noise = Vector3::new(
            self.drift * self.drift * interval.travelled + 1e-12 * interval.elapsed,
            innovation * self.tilt_sigma[0].powi(2),
            innovation * self.tilt_sigma[1].powi(2),
        );
        let transition = Vector3::new(1.0, correlation, correlation);
        (Matrix3::from_diagonal(&transition), Matrix3::from_diagonal(&noise))
    }
}
