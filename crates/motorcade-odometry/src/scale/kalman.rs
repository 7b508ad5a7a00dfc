//! Forward and backward pass of the smoother; means are relative to the mean of the model.

use motorcade_geometry::robust::{median, sigma_from_absolute};
use motorcade_geometry::rts::{self, FilterStep, Smoothed};
use nalgebra::{Matrix3, Vector3};

use super::options::SmootherOptions;
use super::state::{
    Interval, NoiseModel, OF_LOG_SCALE, OF_PITCH, OF_ROLL, ScaleAndTilt, SmoothedState, StateMeasurement,
};

/// Kalman filter in which outliers lose weight; returns the states and the log likelihood.
pub(super) fn forward(
    intervals: &[Interval],
    measurements: &[Option<&StateMeasurement>],
    model: &NoiseModel,
    options: &SmootherOptions,
) -> (Vec<FilterStep<3>>, f64) {
    let mean = model.mean();
    let (mut x, mut p) = initial(measurements, model, options);
    let mut likelihood = 0.0;
    let mut out = Vec::with_capacity(intervals.len());
    for (interval, measured) in intervals.iter().zip(measurements) {
        let (transition, process_noise) = model.transition(interval, options);
        x = transition * x;
        p = transition * p * transition.transpose() + process_noise;
        let (predicted, predicted_covariance) = (x, p);
        if let Some(m) = measured {
            let innovation = m.value.to_vector() - mean - x;
            let mut noise = m.covariance;
            if m.of_road {
                noise[OF_LOG_SCALE] += model.height_sigma.powi(2);
            }
            noise[OF_PITCH] += options.pitch_floor_rad * options.pitch_floor_rad;
            noise[OF_ROLL] += options.roll_floor_rad * options.roll_floor_rad;
            if let Some(inverse) = (p + noise).try_inverse() {
                let d2 = innovation.dot(&(inverse * innovation));
                // Log density of a Student t distribution in three dimensions.
                let determinant = (p + noise).determinant().max(1e-300);
                let freedom = options.student_freedom;
                likelihood -= 0.5 * determinant.ln() + 0.5 * (freedom + 3.0) * (1.0 + d2 / freedom).ln();
                let weight = (options.gate * options.gate / d2.max(1e-12)).min(1.0);
                if let Some(weighted) = (p + noise / weight).try_inverse() {
                    let gain = p * weighted;
                    x += gain * innovation;
                    p = (Matrix3::identity() - gain) * p;
                    p = (p + p.transpose()) * 0.5;
                }
            }
        }
        let (filtered, filtered_covariance) = (x, p);
        out.push(FilterStep { transition, predicted, predicted_covariance, filtered, filtered_covariance });
    }
    (out, likelihood)
}

/// State before the first frame: median of the first measurements, because the very first may be an outlier.
fn initial(
    measurements: &[Option<&StateMeasurement>],
    model: &NoiseModel,
    options: &SmootherOptions,
) -> (Vector3<f64>, Matrix3<f64>) {
    let first = measurements.iter().flatten().take(options.initial_measurements);
    // The road's own errors show in its spread; few distances by another sensor have none.
    let least = first
        .clone()
        .map(|m| if m.of_road { options.least_first_sigma } else { m.covariance[OF_LOG_SCALE].sqrt() });
    let least = least.fold(f64::INFINITY, f64::min).min(options.first_sigma);
    let mut first: Vec<f64> = first.map(|m| m.value.log_scale).collect();
    let centre = median(&mut first).unwrap_or(0.0);
    let mut spread: Vec<f64> = first.iter().map(|v| (v - centre).abs()).collect();
    let spread = sigma_from_absolute(&mut spread).unwrap_or(options.first_sigma).max(least);
    let sigmas = Vector3::new(spread, model.tilt_sigma[0], model.tilt_sigma[1]);
    (Vector3::new(centre, 0.0, 0.0), Matrix3::from_diagonal(&sigmas.map(|s| s * s)))
}

/// Smoothed states out of the forward pass.
pub(super) fn backward(filtered: &[FilterStep<3>], model: &NoiseModel) -> Vec<SmoothedState> {
    let states = rts::smooth_about(&model.mean(), filtered);
    // Correlation with the state before: Cov(x_k−1, x_k) over both standard deviations.
    let correlation = |k: usize| {
        let (before, state) = (states.get(k.wrapping_sub(1))?, states.get(k)?);
        let sigmas = (before.covariance[OF_LOG_SCALE] * state.covariance[OF_LOG_SCALE]).max(0.0).sqrt();
        (sigmas > 0.0).then(|| (before.cross_covariance[OF_LOG_SCALE] / sigmas).clamp(0.0, 1.0))
    };
    let state = |(k, s): (usize, &Smoothed<3>)| SmoothedState {
        value: ScaleAndTilt::from_vector(&s.mean),
        covariance: s.covariance,
        correlation: correlation(k).unwrap_or(0.0),
        overlap: 1.0,
    };
    states.iter().enumerate().map(state).collect()
}
