//! Standard deviations of an alignment.

use motorcade_dataset::Geodetic;
use nalgebra::{Matrix2x4, Matrix4, Vector2, Vector3};

use super::{AlignOptions, Alignment, Fit, Fix, LevelTrajectory, independent, turned};
use crate::anchor::Anchor;

/// The result of a fit with its standard deviations: from the information of the fixes about heading, start and clock together (on a
/// bend at constant speed they cannot be told apart), those near in time counted as one, and the larger of what the file says and
/// what the residuals show. The clock was known with the standard deviation `prior_s`.
pub(super) fn with_deviations(
    trajectory: &LevelTrajectory,
    (fixes, origin): (&[Fix], &Geodetic),
    fit: &Fit,
    prior_s: f64,
    options: &AlignOptions,
) -> Alignment {
    let at = |k: usize| trajectory.at(fixes[k].time_s - fit.offset_s).unwrap_or_default();
    let sum: f64 = fit.weights.iter().sum();
    let mean = |of: &dyn Fn(usize) -> f64| {
        fit.used.iter().zip(&fit.weights).map(|(k, w)| w * of(*k)).sum::<f64>() / sum
    };
    let apart = |k: usize| (fixes[k].at - turned(&at(k).xy(), fit.heading) - fit.shift).norm();
    let rms_m = mean(&|k| apart(k).powi(2)).sqrt();
    let one = mean(&|k| fixes[k].sigma).max(rms_m / 2_f64.sqrt());
    let mut information = Matrix4::zeros();
    for (k, w) in fit.used.iter().zip(&fit.weights) {
        let rows = jacobian(trajectory, &fixes[*k], fit, options.half_velocity_s);
        information += rows.transpose() * rows * (w / sum);
    }
    information *= independent(fixes, &fit.used, options) / (one * one);
    information[(3, 3)] += 1.0 / (prior_s * prior_s).max(1e-9);
    let covariance = covariance(&information, fit.offset_sigma_s);
    let sigma = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let outliers = fit.used.iter().filter(|k| apart(**k) > 3.0 * fixes[**k].sigma.max(one)).count();
    let up = mean(&|k| fixes[k].up - at(k).z);
    Alignment {
        anchor: Anchor {
            start: origin.moved(&Vector3::new(fit.shift.x, fit.shift.y, up)),
            heading_deg: fit.heading.to_degrees().rem_euclid(360.0),
            sigma: Some((sigma(1).hypot(sigma(2)), sigma(0).to_degrees())),
            clock_offset_s: Some(fit.offset_s),
        },
        clock_sigma_s: sigma(3),
        rms_m,
        fixes: (fit.used.len(), outliers),
    }
}

/// Covariance of heading, start and clock, whose standard deviation is `least_s` at least: where several offsets fit, each is more certain than all
/// are. Heading and start follow the clock as the fixes have them at each offset.
fn covariance(information: &Matrix4<f64>, least_s: f64) -> Matrix4<f64> {
    let unknown = || Matrix4::identity() * f64::INFINITY;
    let Some(local) = information.try_inverse() else { return unknown() };
    let clock = local[(3, 3)];
    if !(clock > 0.0 && least_s * least_s > clock) {
        return local;
    }
    // Regression of all on the clock.
    let by_clock = local.column(3) / clock;
    local + by_clock * by_clock.transpose() * (least_s * least_s - clock)
}

/// Derivative of the place of the camera at the time of a fix by heading \[rad\], start \[m\] and clock offset \[s\].
fn jacobian(trajectory: &LevelTrajectory, fix: &Fix, fit: &Fit, half_s: f64) -> Matrix2x4<f64> {
    let time_s = fix.time_s - fit.offset_s;
    let at = trajectory.at(time_s).unwrap_or_default().xy();
    let (before, after) = (trajectory.at(time_s - half_s), trajectory.at(time_s + half_s));
    let velocity = before.zip(after).map_or_else(Vector2::zeros, |(a, b)| (b - a).xy() / (2.0 * half_s));
    let by_heading = turned(&at, fit.heading + std::f64::consts::FRAC_PI_2);
    let by_clock = -turned(&velocity, fit.heading);
    Matrix2x4::new(by_heading.x, 1.0, 0.0, by_clock.x, by_heading.y, 0.0, 1.0, by_clock.y)
}
