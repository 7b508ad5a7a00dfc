//! Metric scale, road pitch and roll over time: a robust Rauch–Tung–Striebel smoother.
//!
//! State `[log s, pitch, roll]`. The odometry's scale drifts slowly (random walk per distance travelled); pitch and roll
//! swing with the suspension about the camera's mounting (first-order autoregressive in time). The drift and the noise of a
//! single frame are chosen by maximum likelihood on the drive.

use motorcade_geometry::robust::median;

use super::kalman::{backward, forward};
use super::options::SmootherOptions;
use super::state::{Interval, NoiseModel, SmoothedState, StateMeasurement};
use crate::time::CALIBRATION_INTERVAL_S;

/// Smooths over all frames; `intervals[k]` leads from frame k−1 to k. `None` without measurements; `unknown_rad` is the standard
/// deviation of a tilt that none of them measures. Linear in the number of frames; the likelihood is evaluated at measured frames only.
pub(super) fn smooth(
    intervals: &[Interval],
    measurements: &[StateMeasurement],
    unknown_rad: f64,
    options: &SmootherOptions,
) -> Option<(Vec<SmoothedState>, NoiseModel)> {
    let mut by_frame: Vec<Option<&StateMeasurement>> = vec![None; intervals.len()];
    for m in measurements.iter().filter(|m| m.frame < intervals.len()) {
        by_frame[m.frame] = Some(m);
    }
    let tilt = NoiseModel::of_tilt(measurements, unknown_rad, options)?;
    let model = most_likely(intervals, &by_frame, &tilt, options)?;
    let (filtered, _) = forward(intervals, &by_frame, &model, options);
    let mut states = backward(&filtered, &model);
    let on_road = measurements.iter().filter(|m| m.of_road).count();
    let overlap = overlap(intervals, &by_frame, on_road, options);
    for state in &mut states {
        state.overlap = overlap;
        // Variance times overlap, covariances with the tilt times its root.
        for k in 0..3 {
            state.covariance[(0, k)] *= overlap.sqrt();
            state.covariance[(k, 0)] *= overlap.sqrt();
        }
    }
    Some((states, model))
}

/// The drift and the noise of a frame under which the measurements are most likely.
fn most_likely(
    intervals: &[Interval],
    by_frame: &[Option<&StateMeasurement>],
    tilt: &NoiseModel,
    options: &SmootherOptions,
) -> Option<NoiseModel> {
    // Frames without a measurement only lengthen the interval to the next one.
    let (mut merged, mut measured) = (Vec::new(), Vec::new());
    let nothing = Interval { travelled: 0.0, elapsed: 0.0 };
    let mut sum = nothing;
    for (interval, m) in intervals.iter().zip(by_frame) {
        sum.travelled += interval.travelled;
        sum.elapsed += interval.elapsed;
        if m.is_some() {
            merged.push(std::mem::replace(&mut sum, nothing));
            measured.push(*m);
        }
    }
    let mut best: Option<(f64, NoiseModel)> = None;
    for drift in options.drifts {
        for height_sigma in options.height_sigmas {
            let model = NoiseModel { drift, height_sigma, ..*tilt };
            let likelihood = forward(&merged, &measured, &model, options).1;
            if best.as_ref().is_none_or(|b| likelihood > b.0) {
                best = Some((likelihood, model));
            }
        }
    }
    best.map(|(_, model)| model)
}

/// Number of measurements that cover the same stretch of road and share its deviation from a plane. The filter takes them as
/// independent; its variance of scale is too small by this factor.
fn overlap(
    intervals: &[Interval],
    by_frame: &[Option<&StateMeasurement>],
    measurements: usize,
    options: &SmootherOptions,
) -> f64 {
    if measurements == 0 {
        return 1.0;
    }
    let travelled: f64 = intervals.iter().map(|i| i.travelled).sum();
    let step = travelled / measurements as f64;
    let (mut elapsed, mut spacings) = (0.0, Vec::new());
    for (interval, m) in intervals.iter().zip(by_frame) {
        elapsed += interval.elapsed;
        if m.is_some_and(|m| m.of_road) {
            spacings.push(std::mem::take(&mut elapsed));
        }
    }
    let spacing_s = median(&mut spacings).filter(|s| *s > 0.0).unwrap_or(1.0) * CALIBRATION_INTERVAL_S;
    let most = (options.shared_s / spacing_s).max(1.0);
    (options.stretch_heights / step.max(1e-3)).clamp(1.0, most)
}

#[cfg(test)]
mod tests {
    use super::super::state::{OF_LOG_SCALE, OF_PITCH, ScaleAndTilt};
    use super::*;
    use nalgebra::{Matrix3, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn follows_a_drifting_scale_through_outliers() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let gauss = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let n = 300;
        let options = SmootherOptions::default();
        let intervals = vec![Interval { travelled: 0.6, elapsed: 1.0 }; n];
        let truth = |k: usize| 0.5 + 0.1 * (k as f64 / 100.0).sin();
        let sigma = Vector3::new(0.02, 0.004, 0.006);
        let measurements: Vec<_> = (0..n)
            .map(|k| {
                let outlier = if k % 17 == 0 { 0.4 } else { 0.0 };
                let noise =
                    Vector3::new(gauss(&mut rng), gauss(&mut rng), gauss(&mut rng)).component_mul(&sigma);
                let value = Vector3::new(truth(k) + outlier, 0.01, -0.02) + noise;
                // Three times too small, as with correlated pixels.
                StateMeasurement {
                    frame: k,
                    value: ScaleAndTilt::from_vector(&value),
                    covariance: Matrix3::from_diagonal(&(sigma / 3.0).map(|s| s * s)),
                    of_road: true,
                }
            })
            .collect();
        let (states, model) = smooth(&intervals, &measurements, 0.02, &options).unwrap();
        let rms =
            (states.iter().enumerate().map(|(k, s)| (s.value.log_scale - truth(k)).powi(2)).sum::<f64>()
                / n as f64)
                .sqrt();
        assert!(rms < 0.01, "rms {rms}");
        assert!(model.height_sigma > 0.01 && model.drift < 0.01, "{model:?}");
        assert!(smooth(&intervals, &[], 0.02, &options).is_none());
    }

    #[test]
    fn distances_give_the_scale_between_measurements_of_the_road() {
        let options = SmootherOptions::default();
        let n = 200;
        let intervals = vec![Interval { travelled: 0.6, elapsed: 1.0 }; n];
        let truth = |k: usize| 0.5 + 0.002 * k as f64;
        let road = |k: usize| StateMeasurement {
            frame: k,
            value: ScaleAndTilt { log_scale: truth(k), pitch_rad: 0.01, roll_rad: -0.02 },
            covariance: Matrix3::identity() * 1e-5,
            of_road: true,
        };
        // The road is seen at the beginning alone.
        let mut measured: Vec<_> = (0..40).map(road).collect();
        let error = |measured: &[StateMeasurement]| {
            let (states, _) = smooth(&intervals, measured, 0.02, &options).unwrap();
            (states[n - 1].value.log_scale - truth(n - 1), states[n - 1].covariance[OF_LOG_SCALE].sqrt())
        };
        let (alone, wide) = error(&measured);
        let distances = (45..n).step_by(10).map(|k| StateMeasurement::of_scale(k, truth(k), 4e-4));
        measured.extend(distances.clone());
        let (helped, narrow) = error(&measured);
        assert!(
            helped.abs() < narrow && alone.abs() > 0.2 && narrow < 0.04,
            "{alone} ± {wide}, {helped} ± {narrow}"
        );
        // Without any road the tilt stays unknown.
        let (states, model) = smooth(&intervals, &distances.collect::<Vec<_>>(), 0.02, &options).unwrap();
        let tilt_sigma = states[100].covariance[OF_PITCH].sqrt();
        assert!(model.mean_tilt == [0.0, 0.0] && (tilt_sigma - 0.02).abs() < 1e-3, "{tilt_sigma}");
        assert!((states[100].value.log_scale - truth(100)).abs() < 0.02);
    }

    /// The same drive, measured ten times a second, with frames in between at higher rates.
    #[test]
    fn frames_without_measurements_change_nothing() {
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let options = SmootherOptions::default();
        let noise: Vec<Vector3<f64>> =
            (0..200).map(|_| Vector3::from_fn(|_, _| rng.random_range(-0.01..0.01))).collect();
        let run = |frames_each: usize| {
            let share = 1.0 / frames_each as f64;
            let interval = Interval { travelled: 0.6 * share, elapsed: share };
            let measured = noise.iter().enumerate().map(|(k, noise)| StateMeasurement {
                frame: (k + 1) * frames_each - 1,
                value: ScaleAndTilt::from_vector(
                    &(Vector3::new(0.5 + 0.001 * k as f64, 0.01, -0.02) + noise),
                ),
                covariance: Matrix3::identity() * 1e-5,
                of_road: true,
            });
            let measured: Vec<_> = measured.collect();
            smooth(&vec![interval; noise.len() * frames_each], &measured, 0.02, &options).unwrap()
        };
        let (reference, model) = run(1);
        for frames_each in [2, 5] {
            let (states, same) = run(frames_each);
            assert!((same.drift, same.height_sigma) == (model.drift, model.height_sigma));
            for (k, expected) in reference.iter().enumerate() {
                let found = &states[(k + 1) * frames_each - 1];
                assert!(
                    (found.value.to_vector() - expected.value.to_vector()).norm() < 1e-9,
                    "{k}: {found:?} {expected:?}"
                );
                assert!((found.covariance - expected.covariance).norm() < 1e-9);
            }
        }
    }
}
