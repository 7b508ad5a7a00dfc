//! Options of simulated measurements.

use super::keypoints::KeypointOptions;
use crate::error::{Error, Result};

/// Options of simulated measurements, and their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureOptions {
    /// Landmarks per metre of road.
    pub landmarks_per_m: f64,
    /// Candidate road matches of a pair of frames.
    pub road_matches: usize,
    /// Standard deviation of an image point of a landmark or of the road \[px\].
    pub pixel_sigma_px: f64,
    /// Share of these points that are outliers, up to 30 px off.
    pub outlier_share: f64,
    /// Probability that one of these points is missing in a frame.
    pub drop_chance: f64,
    /// Errors of keypoints.
    pub keypoints: KeypointOptions,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        Self {
            landmarks_per_m: 4.0,
            road_matches: 120,
            pixel_sigma_px: 0.4,
            outlier_share: 0.03,
            drop_chance: 0.05,
            keypoints: KeypointOptions::default(),
        }
    }
}

impl MeasureOptions {
    /// No errors at all.
    pub fn perfect() -> Self {
        let keypoints =
            KeypointOptions { sigma_px: 0.0, sigma_share: 0.0, swap_chance: 0.0, ..Default::default() };
        Self { pixel_sigma_px: 0.0, outlier_share: 0.0, drop_chance: 0.0, keypoints, ..Self::default() }
    }

    pub(super) fn validate(&self) -> Result<()> {
        let fine = |what: &str, value: f64, most: f64| {
            // NaN lies in no range.
            if (0.0..=most).contains(&value) {
                return Ok(());
            }
            Err(Error::Plan(format!("{what} must lie in [0, {most}], got {value}")))
        };
        fine("landmarks a metre", self.landmarks_per_m, 1000.0)?;
        fine("noise [px]", self.pixel_sigma_px, 1e3)?;
        fine("the share of outliers", self.outlier_share, 1.0)?;
        fine("the chance of drop-outs", self.drop_chance, 1.0)?;
        fine("keypoint noise [px]", self.keypoints.sigma_px, 1e3)?;
        fine("keypoint noise [share of height]", self.keypoints.sigma_share, 1.0)?;
        fine("the chance of swapped keypoints", self.keypoints.swap_chance, 1.0)
    }
}
