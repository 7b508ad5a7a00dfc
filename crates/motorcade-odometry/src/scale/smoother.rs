//! Metric scale, road pitch and roll over time: a robust Rauch–Tung–Striebel smoother.
//!
//! State `[log s, pitch, roll]`. The odometry's scale drifts slowly (random walk per distance travelled); pitch and roll
//! swing with the suspension about the camera's mounting (first-order autoregressive). How steady the odometry is and how
//! far a single frame may be trusted is not set by hand: both are chosen by maximum likelihood on the drive.

use motorcade_geometry::robust::{median, sigma_from_absolute};
use nalgebra::{Matrix3, Vector3};

/// A measurement at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateMeasurement {
    /// Frame it belongs to.
    pub frame: usize,
    /// `[log s, pitch, roll]`.
    pub value: Vector3<f64>,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
}

/// Smoothed state of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedState {
    /// `[log s, pitch, roll]`.
    pub value: Vector3<f64>,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
    /// Correlation of the errors of log s with those of the frame before, 0 to 1: what makes scale errors add up.
    pub correlation: f64,
    /// How many neighbouring measurements count as one in the covariance of log s.
    pub overlap: f64,
}

/// What the drive itself told about noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// Drift of log s per √(camera height travelled).
    pub drift: f64,
    /// Standard deviation of log s of a single frame beyond what its pixels explain: the body heaves, the road is not flat.
    pub height_sigma: f64,
    /// Mean pitch and roll \[rad\].
    pub mean_tilt: [f64; 2],
    /// Standard deviations of pitch and roll about it \[rad\].
    pub tilt_sigma: [f64; 2],
}

/// Correlation of pitch and roll from one frame to the next at 10 Hz: a car body swings at 1–2 Hz.
const TILT_CORRELATION: f64 = 0.7;
/// What a single frame's pitch may be off beyond its pixels: a lane is not a plane to a tenth of a degree \[rad\].
const PITCH_FLOOR_RAD: f64 = 1.7e-3;
/// The same for roll, which a narrow lane with crown and ruts shows badly: 0.4° \[rad\].
const ROLL_FLOOR_RAD: f64 = 7e-3;
/// Measurements beyond this Mahalanobis distance lose weight (√ of the 95 % quantile of χ²₃).
const GATE: f64 = 2.8;

/// Smooths over `travelled.len()` frames; `travelled[k]` is the distance from frame k−1 to k \[camera heights\].
/// `None` without measurements.
pub fn smooth(
    travelled: &[f64],
    measurements: &[StateMeasurement],
) -> Option<(Vec<SmoothedState>, NoiseModel)> {
    let base = tilt_statistics(measurements)?;
    let by_frame = {
        let mut table: Vec<Option<&StateMeasurement>> = vec![None; travelled.len()];
        for m in measurements.iter().filter(|m| m.frame < travelled.len()) {
            table[m.frame] = Some(m);
        }
        table
    };
    const DRIFTS: [f64; 7] = [0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03];
    const HEIGHT_SIGMAS: [f64; 7] = [0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05];
    let mut best: Option<(f64, NoiseModel)> = None;
    for drift in DRIFTS {
        for height_sigma in HEIGHT_SIGMAS {
            let model = NoiseModel { drift, height_sigma, ..base };
            let likelihood = forward(travelled, &by_frame, &model).1;
            if best.as_ref().is_none_or(|b| likelihood > b.0) {
                best = Some((likelihood, model));
            }
        }
    }
    let (_, model) = best?;
    let (filtered, _) = forward(travelled, &by_frame, &model);
    let mut states = backward(travelled, &filtered, &model);
    let overlap = overlap(travelled, measurements);
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

fn tilt_statistics(measurements: &[StateMeasurement]) -> Option<NoiseModel> {
    let one = |k: usize, floor: f64| -> Option<(f64, f64)> {
        let mut values: Vec<f64> = measurements.iter().map(|m| m.value[k]).collect();
        let mean = median(&mut values)?;
        let mut absolute: Vec<f64> = values.iter().map(|v| (v - mean).abs()).collect();
        // Between a stiff lorry and a soft old car; roll is measured badly, so its spread is mostly noise.
        Some((mean, sigma_from_absolute(&mut absolute)?.clamp(floor, 3.0 * floor)))
    };
    let (pitch, pitch_sigma) = one(1, 0.15_f64.to_radians())?;
    let (roll, roll_sigma) = one(2, 0.15_f64.to_radians())?;
    Some(NoiseModel {
        drift: 0.0,
        height_sigma: 0.0,
        mean_tilt: [pitch, roll],
        tilt_sigma: [pitch_sigma, roll_sigma],
    })
}

/// How many measurements look at the same stretch of road, and share what makes it no plane: each sees this far, one frame's
/// step further on. The filter takes them as independent; its variance of scale is that many times too small.
fn overlap(travelled: &[f64], measurements: &[StateMeasurement]) -> f64 {
    /// Length of the stretch of a measurement \[camera heights\]: from where the bonnet ends to the far end of it.
    const STRETCH_HEIGHTS: f64 = 11.0;
    let way: f64 = travelled.iter().sum();
    let step = way / measurements.len().max(1) as f64;
    (STRETCH_HEIGHTS / step.max(1e-3)).clamp(1.0, 20.0)
}

struct Filtered {
    predicted: (Vector3<f64>, Matrix3<f64>),
    updated: (Vector3<f64>, Matrix3<f64>),
}

fn transition() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, TILT_CORRELATION, TILT_CORRELATION))
}

fn process_noise(travelled: f64, model: &NoiseModel) -> Matrix3<f64> {
    let tilt = 1.0 - TILT_CORRELATION * TILT_CORRELATION;
    Matrix3::from_diagonal(&Vector3::new(
        model.drift * model.drift * travelled + 1e-12,
        tilt * model.tilt_sigma[0].powi(2),
        tilt * model.tilt_sigma[1].powi(2),
    ))
}

fn mean(model: &NoiseModel) -> Vector3<f64> {
    Vector3::new(0.0, model.mean_tilt[0], model.mean_tilt[1])
}

/// Kalman filter with Student-like down-weighting of outliers; returns the states and the log likelihood.
fn forward(
    travelled: &[f64],
    by_frame: &[Option<&StateMeasurement>],
    model: &NoiseModel,
) -> (Vec<Filtered>, f64) {
    let centre = mean(model);
    // Begin where the first measurements agree: the very first may be an outlier.
    let mut first: Vec<f64> = by_frame.iter().flatten().take(15).map(|m| m.value.x).collect();
    let begin = median(&mut first).unwrap_or(0.0);
    let mut spread: Vec<f64> = first.iter().map(|v| (v - begin).abs()).collect();
    let spread = sigma_from_absolute(&mut spread).unwrap_or(0.2).max(0.01);
    let mut x = Vector3::new(begin, 0.0, 0.0);
    let mut p = Matrix3::from_diagonal(
        &Vector3::new(spread, model.tilt_sigma[0], model.tilt_sigma[1]).map(|s| s * s),
    );
    let (f, mut likelihood) = (transition(), 0.0);
    let mut out = Vec::with_capacity(travelled.len());
    for (step, measured) in travelled.iter().zip(by_frame) {
        x = f * x;
        p = f * p * f.transpose() + process_noise(*step, model);
        let predicted = (x, p);
        if let Some(m) = measured {
            let innovation = m.value - centre - x;
            let mut noise = m.covariance;
            noise[(0, 0)] += model.height_sigma.powi(2);
            noise[(1, 1)] += PITCH_FLOOR_RAD * PITCH_FLOOR_RAD;
            noise[(2, 2)] += ROLL_FLOOR_RAD * ROLL_FLOOR_RAD;
            if let Some(inverse) = (p + noise).try_inverse() {
                let d2 = innovation.dot(&(inverse * innovation));
                // Heavy tails: the likelihood of a Student t with 4 degrees of freedom, and its weight.
                let determinant = (p + noise).determinant().max(1e-300);
                likelihood -= 0.5 * determinant.ln() + 3.5 * (1.0 + d2 / 4.0).ln();
                let weight = (GATE * GATE / d2.max(1e-12)).min(1.0);
                if let Some(weighted) = (p + noise / weight).try_inverse() {
                    let gain = p * weighted;
                    x += gain * innovation;
                    p = (Matrix3::identity() - gain) * p;
                    p = (p + p.transpose()) * 0.5;
                }
            }
        }
        out.push(Filtered { predicted, updated: (x, p) });
    }
    (out, likelihood)
}

fn backward(travelled: &[f64], filtered: &[Filtered], model: &NoiseModel) -> Vec<SmoothedState> {
    let (f, centre) = (transition(), mean(model));
    let mut out: Vec<SmoothedState> = Vec::with_capacity(filtered.len());
    for k in (0..filtered.len()).rev() {
        let (mut x, mut p) = filtered[k].updated;
        if let (Some(next), Some(ahead)) = (out.last_mut(), filtered.get(k + 1))
            && let Some(inverse) = ahead.predicted.1.try_inverse()
        {
            let gain = p * f.transpose() * inverse;
            x += gain * (next.value - centre - ahead.predicted.0);
            p += gain * (next.covariance - ahead.predicted.1) * gain.transpose();
            // Cov(x_k, x_k+1) of the smoothed states is the gain times the later covariance.
            let shared = (gain * next.covariance)[(0, 0)];
            let sigmas = (p[(0, 0)] * next.covariance[(0, 0)]).max(0.0).sqrt();
            next.correlation = if sigmas > 0.0 { (shared / sigmas).clamp(0.0, 1.0) } else { 0.0 };
        }
        let covariance = (p + p.transpose()) * 0.5;
        out.push(SmoothedState { value: x + centre, covariance, correlation: 0.0, overlap: 1.0 });
    }
    debug_assert_eq!(out.len(), travelled.len());
    out.reverse();
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn follows_a_drifting_scale_through_outliers() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let gauss = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let n = 300;
        let truth = |k: usize| 0.5 + 0.1 * (k as f64 / 100.0).sin();
        let sigma = Vector3::new(0.02, 0.004, 0.006);
        let measurements: Vec<_> = (0..n)
            .map(|k| {
                let outlier = if k % 17 == 0 { 0.4 } else { 0.0 };
                let noise =
                    Vector3::new(gauss(&mut rng), gauss(&mut rng), gauss(&mut rng)).component_mul(&sigma);
                let value = Vector3::new(truth(k) + outlier, 0.01, -0.02) + noise;
                // Reported three times too small, as correlated pixels do.
                StateMeasurement {
                    frame: k,
                    value,
                    covariance: Matrix3::from_diagonal(&(sigma / 3.0).map(|s| s * s)),
                }
            })
            .collect();
        let (states, model) = smooth(&vec![0.6; n], &measurements).unwrap();
        let rms = (states.iter().enumerate().map(|(k, s)| (s.value.x - truth(k)).powi(2)).sum::<f64>()
            / n as f64)
            .sqrt();
        assert!(rms < 0.01, "rms {rms}");
        assert!(model.height_sigma > 0.01 && model.drift < 0.01, "{model:?}");
        assert!(smooth(&vec![0.6; n], &[]).is_none());
    }
}
