//! Whether a run knows how wrong it is: the normalised estimation error squared (NEES) of its poses.

use std::path::Path;

use motorcade_dataset::Error as InputError;
use motorcade_geometry::{Camera, Pose};
use nalgebra::Matrix6;

use crate::ego::Compared;
use crate::error::Result;
use crate::statistics::median;

/// Values between which a χ² of six degrees of freedom lies with 95 %.
const CHI2_6_BAND: [f64; 2] = [1.237, 14.449];
/// Value below which it lies with 95 %.
const CHI2_6_95: f64 = 12.592;

/// How the errors of the poses compare with their covariances; first poses identified. A truth that errs itself (GPS and
/// inertial: some 0.1 m) counts as error of the run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ConsistencyReport {
    /// Poses with a covariance.
    pub frames: usize,
    /// Median of `eᵀ Σ⁻¹ e`, e = log(estimate⁻¹ · truth) (6); 5.3 when all is well.
    pub nees_median: f64,
    /// Share of poses whose error its covariance allows at 95 % (≤ 12.6).
    pub nees_allowed: f64,
    /// Share of poses within the two-sided 95 % band (1.24 to 14.4).
    pub nees_in_band: f64,
}

/// Judges poses by their covariances; `None` when none has one.
pub(crate) fn consistency(compared: &Compared, covariances: &[Matrix6<f64>]) -> Option<ConsistencyReport> {
    let pairs = compared.estimate.iter().zip(&compared.truth).zip(covariances);
    let nees = pairs.filter_map(|((estimate, truth), covariance)| {
        let error = (estimate.inverse() * *truth).cast::<Camera, Camera>() as Pose<Camera, Camera>;
        let e = error.log();
        Some(e.dot(&(covariance.cholesky()?.solve(&e))))
    });
    let nees: Vec<f64> = nees.collect();
    let share = |good: &dyn Fn(f64) -> bool| {
        nees.iter().filter(|v| good(**v)).count() as f64 / nees.len().max(1) as f64
    };
    Some(ConsistencyReport {
        frames: nees.len(),
        nees_allowed: share(&|v| v <= CHI2_6_95),
        nees_in_band: share(&|v| (CHI2_6_BAND[0]..=CHI2_6_BAND[1]).contains(&v)),
        nees_median: median(nees)?,
    })
}

/// Reads `ego_covariance.csv`: frame and 21 numbers a row.
pub(crate) fn read_covariances(path: &Path) -> Result<Vec<Matrix6<f64>>> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| InputError::Input { path: path.to_path_buf(), problem: e.to_string() })?;
    let row = |(k, line): (usize, &str)| {
        let numbers: std::result::Result<Vec<f64>, _> = line.split(',').skip(1).map(str::parse).collect();
        let numbers = numbers.ok().filter(|n| n.len() == 21).ok_or_else(|| InputError::Input {
            path: path.to_path_buf(),
            problem: format!("line {}: expected the frame and 21 numbers", k + 2),
        })?;
        let mut covariance = Matrix6::zeros();
        let places = (0..6).flat_map(|r| (r..6).map(move |c| (r, c)));
        for ((r, c), value) in places.zip(numbers) {
            covariance[(r, c)] = value;
            covariance[(c, r)] = value;
        }
        Ok(covariance)
    };
    text.lines().skip(1).enumerate().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::World;
    use nalgebra::Vector6;

    #[test]
    fn errors_of_the_size_told_are_allowed_and_larger_ones_are_not() {
        let truth: Vec<Pose<World, Camera>> = vec![Pose::identity(); 9];
        let off = |k: usize| Vector6::from_fn(|i, _| if i == k % 6 && k > 0 { 0.1 } else { 0.0 });
        let estimate: Vec<Pose<World, Camera>> = (0..9).map(|k| Pose::exp(&off(k))).collect();
        let compared = Compared::new(&estimate, &truth).unwrap();
        let told = |sigma: f64| vec![Matrix6::identity() * sigma * sigma; 9];
        let fair = consistency(&compared, &told(0.05)).unwrap();
        assert!((fair.nees_median - 4.0).abs() < 1e-9 && fair.nees_allowed == 1.0, "{fair:?}");
        let proud = consistency(&compared, &told(0.01)).unwrap();
        assert!(proud.nees_allowed < 0.2 && proud.nees_in_band == 0.0, "{proud:?}");
        assert!(consistency(&compared, &[]).is_none());
    }
}
