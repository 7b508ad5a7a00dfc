//! Estimate of the lens with its covariance.

use motorcade_geometry::robust::median;
use nalgebra::Matrix4;

use crate::adjustment::Adjustment;
use crate::lens::Lens;
use crate::options::CalibrateOptions;
use crate::prior::LensPrior;
use crate::window::Window;

/// A lens with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct LensEstimate {
    /// The lens.
    pub lens: Lens,
    /// Covariance of ln f, k1, cx \[px\], cy \[px\].
    pub covariance: Matrix4<f64>,
    /// Angle that the camera turned through in the keyframes used \[rad\].
    pub turned_rad: f64,
    /// Keyframes used.
    pub keyframes: usize,
    /// Corners used.
    pub corners: usize,
    /// Median reprojection error \[px\].
    pub median_error_px: f64,
}

/// Noise of a coordinate.
fn noise_px(median_error_px: f64) -> f64 {
    median_error_px / RAYLEIGH_MEDIAN
}

/// Median of a Rayleigh distribution over its σ, derived: errors in two coordinates.
const RAYLEIGH_MEDIAN: f64 = 1.1774;

impl LensEstimate {
    /// From an adjustment at its solution.
    pub(crate) fn new(adjustment: &Adjustment, prior: &LensPrior, options: &CalibrateOptions) -> Self {
        let Adjustment { lens, windows } = adjustment;
        let squared = windows.iter().flat_map(|w| w.squared_errors(lens, options.advanced.behind_px));
        let mut errors: Vec<f64> = squared.map(f64::sqrt).collect();
        let median_error_px = median(&mut errors).unwrap_or(0.0);
        let noise = noise_px(median_error_px).powi(2).max(1e-6);
        let votes = adjustment.votes(options);
        let of_drive = votes.iter().fold(Matrix4::zeros(), |sum, (h, _)| sum + h);
        let total = prior.information(lens) + of_drive;
        // Windows that disagree by more than their pixels say: errors of tracks last from frame to frame.
        let disagreement: f64 = votes.iter().map(|(h, g)| g[0] * g[0] / (h[(0, 0)] * noise)).sum();
        let inflation = (disagreement / (votes.len().max(2) - 1) as f64).max(1.0);
        let inverse = total.try_inverse().unwrap_or_else(Matrix4::identity);
        let mut covariance = inverse * (noise * inflation);
        // An error of the turns is an error of the focal length: f times angle is what pixels measure.
        let turned_rad: f64 = windows.iter().map(Window::turn_rad).sum();
        let by_turns = options.advanced.turn_sigma_rad / turned_rad.max(1e-6);
        if by_turns > prior.log_focal_sigma() {
            // The turns determine less than what was known before: each counts by its share of the estimate.
            let known = (inverse[(0, 0)] * prior.information(lens)[(0, 0)]).clamp(0.0, 1.0);
            let by_drive = covariance[(0, 0)] + by_turns.powi(2);
            covariance.fill_row(0, 0.0);
            covariance.fill_column(0, 0.0);
            covariance[(0, 0)] = (known * prior.log_focal_sigma()).powi(2) + (1.0 - known).powi(2) * by_drive;
            covariance[(0, 0)] += options.advanced.common_focal_sigma.powi(2);
        } else {
            covariance[(0, 0)] += options.advanced.common_focal_sigma.powi(2) + by_turns.powi(2);
        }
        // The prior of k1 has a peak at zero, which holds a drive that says little of distortion whatever the lens is: that is no knowledge of it.
        let open = (prior.information_of_any_lens(options) + of_drive).try_inverse();
        let by_drive =
            open.map_or(options.advanced.any_lens_k1_sigma.powi(2), |o| o[(1, 1)] * noise * inflation);
        covariance[(1, 1)] = covariance[(1, 1)].max(by_drive);
        covariance[(1, 1)] +=
            options.advanced.common_k1_sigma.powi(2) + (options.advanced.common_k1_share * lens.k1).powi(2);
        Self {
            lens: *lens,
            covariance,
            turned_rad,
            keyframes: windows.iter().map(|w| w.poses.len()).sum(),
            corners: windows.iter().map(|w| w.corners.len()).sum(),
            median_error_px,
        }
    }

    /// Noise of a coordinate of a corner \[px\].
    pub fn noise_px(&self) -> f64 {
        noise_px(self.median_error_px)
    }

    /// Standard deviation of ln f: relative error of the focal length.
    pub fn focal_sigma(&self) -> f64 {
        self.covariance[(0, 0)].sqrt()
    }

    /// Standard deviations of f \[px\], k1, cx \[px\], cy \[px\].
    pub fn sigmas(&self) -> [f64; 4] {
        let s = self.covariance.diagonal().map(f64::sqrt);
        [s[0] * self.lens.focal_px, s[1], s[2], s[3]]
    }
}
