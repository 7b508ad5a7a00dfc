//! Consistency of poses and covariances: the normalised estimation error squared (NEES; Bar-Shalom et al. 2001, section 5.4).

use motorcade_geometry::robust::median_midpoint;
use motorcade_geometry::{Camera, Pose, World, mahalanobis_squared};
use nalgebra::Matrix6;

use crate::ego::AlignedTrajectories;
use crate::error::Result;

/// 2.5 % and 97.5 % quantiles of χ²₆.
const CHI2_6_BAND: [f64; 2] = [1.237, 14.449];
/// 95 % quantile of χ²₆.
const CHI2_6_95: f64 = 12.592;

/// NEES of the poses, first poses identified. Errors of the ground truth (GPS and inertial: some 0.1 m) count as errors of the run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ConsistencyReport {
    /// Poses with an invertible covariance.
    pub frames: usize,
    /// Median NEES; 5.35 for consistent covariances, less when they are too large.
    pub nees_median: f64,
    /// Share of poses below the 95 % quantile (≤ 12.6).
    pub nees_allowed: f64,
    /// Share of poses within the two-sided 95 % band (1.24 to 14.4).
    pub nees_in_band: f64,
}

/// NEES `eᵀ Σ⁻¹ e` of each pose, e = log(estimate⁻¹ · truth) (6, `[ω, ν]`), first poses identified; `None` where the covariance is
/// singular, as that of the first pose is.
///
/// # Errors
/// Lists of poses of different lengths, or empty ones.
pub fn nees(
    estimate: &[Pose<World, Camera>],
    truth: &[Pose<World, Camera>],
    covariances: &[Matrix6<f64>],
) -> Result<Vec<Option<f64>>> {
    Ok(of_aligned(&AlignedTrajectories::new(estimate, truth)?, covariances))
}

/// Summary of the NEES of a trajectory; `None` when no pose has a covariance.
///
/// # Errors
/// As [`nees`].
pub fn evaluate_consistency(
    estimate: &[Pose<World, Camera>],
    truth: &[Pose<World, Camera>],
    covariances: &[Matrix6<f64>],
) -> Result<Option<ConsistencyReport>> {
    AlignedTrajectories::new(estimate, truth).map(|aligned| consistency(&aligned, covariances))
}

fn of_aligned(aligned: &AlignedTrajectories, covariances: &[Matrix6<f64>]) -> Vec<Option<f64>> {
    let errors = aligned.estimate.iter().zip(&aligned.truth).map(|(e, t)| (e.inverse() * *t).log());
    errors.zip(covariances).map(|(e, covariance)| mahalanobis_squared(&e, covariance)).collect()
}

pub(crate) fn consistency(
    aligned: &AlignedTrajectories,
    covariances: &[Matrix6<f64>],
) -> Option<ConsistencyReport> {
    let mut nees: Vec<f64> = of_aligned(aligned, covariances).into_iter().flatten().collect();
    let share = |within: &dyn Fn(f64) -> bool| {
        nees.iter().filter(|v| within(**v)).count() as f64 / nees.len().max(1) as f64
    };
    Some(ConsistencyReport {
        frames: nees.len(),
        nees_allowed: share(&|v| v <= CHI2_6_95),
        nees_in_band: share(&|v| (CHI2_6_BAND[0]..=CHI2_6_BAND[1]).contains(&v)),
        nees_median: median_midpoint(&mut nees)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn covariances_that_fit_the_errors_are_consistent() {
        let truth: Vec<Pose<World, Camera>> = vec![Pose::identity(); 9];
        let error = |k: usize| Vector6::from_fn(|i, _| if i == k % 6 && k > 0 { 0.1 } else { 0.0 });
        let estimate: Vec<Pose<World, Camera>> = (0..9).map(|k| Pose::exp(&error(k))).collect();
        let with = |sigma: f64| {
            let covariances = vec![Matrix6::identity() * sigma * sigma; 9];
            evaluate_consistency(&estimate, &truth, &covariances).unwrap().unwrap()
        };
        let consistent = with(0.05);
        assert!((consistent.nees_median - 4.0).abs() < 1e-9 && consistent.nees_allowed == 1.0);
        let overconfident = with(0.01);
        assert!(overconfident.nees_allowed < 0.2 && overconfident.nees_in_band == 0.0, "{overconfident:?}");
        assert!(evaluate_consistency(&estimate, &truth, &[]).unwrap().is_none());
    }
}
