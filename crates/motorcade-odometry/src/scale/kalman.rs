//! Forward and backward pass of the smoother (Rauch, Tung and Striebel 1965).

use motorcade_geometry::robust::{median, sigma_from_absolute};
use nalgebra::{Matrix3, Vector3};

use super::options::SmootherOptions;
use super::state::{Interval, NoiseModel, SmoothedState, StateMeasurement};

/// States of the filter at a frame, relative to the mean of the model.
pub(super) struct Filtered {
    transition: Matrix3<f64>,
    predicted: (Vector3<f64>, Matrix3<f64>),
    updated: (Vector3<f64>, Matrix3<f64>),
}

/// Kalman filter in which outliers lose weight; returns the states and the log likelihood.
pub(super) fn forward(
    intervals: &[Interval],
    measurements: &[Option<&StateMeasurement>],
    model: &NoiseModel,
    options: &SmootherOptions,
) -> (Vec<Filtered>, f64) {
    let mean = model.mean();
    let (mut x, mut p) = initial(measurements, model, options);
    let mut likelihood = 0.0;
    let mut out = Vec::with_capacity(intervals.len());
    for (interval, measured) in intervals.iter().zip(measurements) {
        let (transition, process_noise) = model.transition(interval, options);
        x = transition * x;
        p = transition * p * transition.transpose() + process_noise;
        let predicted = (x, p);
        if let Some(m) = measured {
            let innovation = m.value - mean - x;
            let mut noise = m.covariance;
            noise[(0, 0)] += model.height_sigma.powi(2);
            noise[(1, 1)] += options.pitch_floor_rad * options.pitch_floor_rad;
            noise[(2, 2)] += options.roll_floor_rad * options.roll_floor_rad;
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
        out.push(Filtered { transition, predicted, updated: (x, p) });
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
    let mut first: Vec<f64> = first.map(|m| m.value.x).collect();
    let centre = median(&mut first).unwrap_or(0.0);
    let mut spread: Vec<f64> = first.iter().map(|v| (v - centre).abs()).collect();
    let spread = sigma_from_absolute(&mut spread).unwrap_or(0.2).max(0.01);
    let sigmas = Vector3::new(spread, model.tilt_sigma[0], model.tilt_sigma[1]);
    (Vector3::new(centre, 0.0, 0.0), Matrix3::from_diagonal(&sigmas.map(|s| s * s)))
}

/// Backward pass over the filtered states.
pub(super) fn backward(filtered: &[Filtered], model: &NoiseModel) -> Vec<SmoothedState> {
    let mean = model.mean();
    let mut out: Vec<SmoothedState> = Vec::with_capacity(filtered.len());
    for k in (0..filtered.len()).rev() {
        let (mut x, mut p) = filtered[k].updated;
        if let (Some(next), Some(ahead)) = (out.last_mut(), filtered.get(k + 1))
            && let Some(inverse) = ahead.predicted.1.try_inverse()
        {
            let gain = p * ahead.transition.transpose() * inverse;
            x += gain * (next.value - mean - ahead.predicted.0);
            p += gain * (next.covariance - ahead.predicted.1) * gain.transpose();
            // Cov(x_k, x_k+1) of the smoothed states is the gain times the later covariance.
            let cross = (gain * next.covariance)[(0, 0)];
            let sigmas = (p[(0, 0)] * next.covariance[(0, 0)]).max(0.0).sqrt();
            next.correlation = if sigmas > 0.0 { (cross / sigmas).clamp(0.0, 1.0) } else { 0.0 };
        }
        let covariance = (p + p.transpose()) * 0.5;
        out.push(SmoothedState { value: x + mean, covariance, correlation: 0.0, overlap: 1.0 });
    }
    out.reverse();
    out
}
