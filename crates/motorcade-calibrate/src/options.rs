//! Settings.

use motorcade_geometry::PinholeCamera;

use crate::lens::Lens;

/// Prior of the field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPrior {
    /// Horizontal field of view \[rad\].
    pub view_rad: f64,
    /// Standard deviation of the logarithm of the focal length.
    pub log_sigma: f64,
}

impl Default for ViewPrior {
    /// 70° and a factor of 1.6: of two cameras out of three that are sold for cars, 48° to 97°.
    fn default() -> Self {
        Self { view_rad: 70_f64.to_radians(), log_sigma: 0.5 }
    }
}

impl ViewPrior {
    /// Focal length of that view \[px\].
    pub fn focal_px(&self, width: u32) -> f64 {
        0.5 * f64::from(width) / (0.5 * self.view_rad).tan()
    }

    /// A camera of that view.
    pub fn camera(&self, width: u32, height: u32) -> PinholeCamera {
        Lens::centred(self.focal_px(width), width, height).pinhole(width, height)
    }
}

/// Settings of the calibration.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CalibrateOptions {
    /// Frames at most, from the first on; more take longer.
    pub most_frames: usize,
    /// Windows at most; those in which the camera turns most are taken.
    pub most_windows: usize,
    /// Standard deviation of k1 before the drive, of a lens without distortion. Errors of tracking are alike in neighbouring frames and pass for
    /// a few thousandths, or for two hundredths on a drive that turns little. A smaller one holds a lens with distortion at zero where pictures are poor,
    /// and its focal length is then 11 % too long (BENCHMARK, A camera nobody calibrated).
    pub k1_sigma: f64,
    /// Standard deviation of ln f above which the drive does not determine it.
    pub most_focal_sigma: f64,
    /// Windows, passes, bounds of the adjustment, priors, and the mounting.
    pub advanced: AdvancedCalibrateOptions,
}

/// Windows, passes, bounds of the adjustment, priors, and the mounting.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedCalibrateOptions {
    /// Keyframes adjusted together: some seconds of a turn.
    pub window_keyframes: usize,
    /// Fewer keyframes are no window.
    pub least_keyframes: usize,
    /// Passes over the drive at most without distortion, and again with it.
    pub passes: usize,
    /// Change of ln f below which another pass is not needed.
    pub converged: f64,
    /// Iterations of the adjustment at most.
    pub max_iterations: usize,
    /// Relative decrease of the cost that ends it.
    pub relative_decrease: f64,
    /// Cauchy scale of a reprojection error in the first pass \[px\]; later ones take 2.4 times the noise of the one before.
    pub kernel_px: f64,
    /// Reprojection error above which the odometry drops an observation \[px\]: above what a wrong lens does.
    pub outlier_px: f64,
    /// Noise of a tracked corner \[px\], for the weight of what was known before.
    pub noise_px: f64,
    /// Cauchy scale of k1 \[`k1_sigma`\]: a lens with distortion is free to have it.
    pub k1_kernel: f64,
    /// Standard deviation of k1 of any lens, for the uncertainty that is stated: wide-angle dash-cams have -0.4 to 0. A larger one says more plainly that
    /// a drive did not show the distortion.
    pub any_lens_k1_sigma: f64,
    /// Standard deviation of the principal point from the middle of the picture \[widths\].
    pub centre_sigma: f64,
    /// Standard deviation of ln f that all windows share: no lens is an ideal one.
    pub common_focal_sigma: f64,
    /// Standard deviation of the turns by errors of tracking \[rad\]: over the angle turned it is one of ln f. Ten rendered drives that
    /// turn by 65° to 95° err by 0.7 % (rms), a straight one (5° of swaying) by 8 %, real ones that turn by 14° and 19° by 3 to 6 %.
    pub turn_sigma_rad: f64,
    /// Standard deviation of k1 that all solutions of a drive share.
    pub common_k1_sigma: f64,
    /// Error of k1 that all solutions share, as a share of k1: a lens of several coefficients is described by one. The one real lens it was tried on, with k1 = −0.25, came out as −0.15.
    pub common_k1_share: f64,
    /// Trust in EXIF `FocalLengthIn35mmFilm`, one standard deviation of ln f beside rounding: the correction of distortion crops, focus
    /// breathes. Judged, not measured, as the next two are; larger values leave more to the drive.
    pub exif_film_sigma: f64,
    /// Standard deviation of ln f by EXIF `FocalLength` with the pixel pitch: nominal focal lengths, resolutions that makers copy from another model.
    pub exif_focal_plane_sigma: f64,
    /// Standard deviation of ln f by a video's tag `focal_length.35mm_equivalent`: videos are cropped from what the lens shows, stabilised ones by a tenth and more.
    pub container_film_sigma: f64,
    /// Least Cauchy scale of a reprojection error in later passes \[px\]. Chosen, not measured: a smaller one leaves more corners out
    /// where the noise comes out small.
    pub least_kernel_px: f64,
    /// Reprojection error of a corner that is not in front of the camera \[px\]: that of a far outlier. Chosen: with a larger one steps that put corners
    /// there are refused more often.
    pub behind_px: f64,
    /// Corners of a window, at least. Chosen, not measured: more leave out stretches with little texture.
    pub least_corners: usize,
    /// Mounting of the camera, measured with its new lens.
    pub mounting: MountingOptions,
}

impl Default for AdvancedCalibrateOptions {
    fn default() -> Self {
        Self {
            window_keyframes: 40,
            least_keyframes: 6,
            passes: 6,
            converged: 0.01,
            max_iterations: 40,
            relative_decrease: 1e-6,
            kernel_px: 1.0,
            outlier_px: 8.0,
            noise_px: 0.5,
            k1_kernel: 4.0,
            centre_sigma: 0.01,
            common_focal_sigma: 0.01,
            turn_sigma_rad: 0.6_f64.to_radians(),
            any_lens_k1_sigma: 0.2,
            common_k1_sigma: 0.01,
            common_k1_share: 0.4,
            exif_film_sigma: 0.08,
            exif_focal_plane_sigma: 0.08,
            container_film_sigma: 0.15,
            least_kernel_px: 0.15,
            behind_px: 100.0,
            least_corners: 50,
            mounting: MountingOptions::default(),
        }
    }
}

/// Angles of the camera against the road and the direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MountingOptions {
    /// Time of measured frames that is needed \[s\]. Chosen, not measured: a longer one gives the mounting of fewer drives, and better.
    pub least_s: f64,
    /// Turn of a step beyond which it does not give the direction of travel \[rad/m\]: the camera of a turning car moves aside. Chosen: a larger one
    /// takes more steps, and such motion for yaw of the mounting.
    pub most_turn_rad_per_m: f64,
    /// Time over which the errors of frames are alike \[s\]: a car body swings at 1 to 2 Hz. A longer one widens the standard deviations.
    pub correlation_time_s: f64,
}

impl Default for MountingOptions {
    fn default() -> Self {
        Self { least_s: 1.95, most_turn_rad_per_m: 0.005, correlation_time_s: 1.0 }
    }
}

impl CalibrateOptions {
    /// The first setting out of its range; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        let advanced = &self.advanced;
        for (name, value, least) in [
            ("most_frames", self.most_frames, 1),
            ("advanced.least_keyframes", advanced.least_keyframes, 3),
            ("advanced.window_keyframes", advanced.window_keyframes, advanced.least_keyframes),
            ("most_windows", self.most_windows, 1),
            ("advanced.passes", advanced.passes, 1),
            ("advanced.least_corners", advanced.least_corners, 10),
        ] {
            if value < least {
                return Err(format!("{name} must be at least {least}, got {value}"));
            }
        }
        for (name, value) in [
            ("advanced.kernel_px", advanced.kernel_px),
            ("advanced.outlier_px", advanced.outlier_px),
            ("advanced.noise_px", advanced.noise_px),
            ("k1_sigma", self.k1_sigma),
            ("advanced.any_lens_k1_sigma", advanced.any_lens_k1_sigma),
            ("advanced.k1_kernel", advanced.k1_kernel),
            ("advanced.centre_sigma", advanced.centre_sigma),
            ("advanced.exif_film_sigma", advanced.exif_film_sigma),
            ("advanced.exif_focal_plane_sigma", advanced.exif_focal_plane_sigma),
            ("advanced.container_film_sigma", advanced.container_film_sigma),
            ("advanced.least_kernel_px", advanced.least_kernel_px),
            ("advanced.behind_px", advanced.behind_px),
            ("advanced.mounting.correlation_time_s", advanced.mounting.correlation_time_s),
        ] {
            if value <= 0.0 {
                return Err(format!("{name} must be positive, got {value}"));
            }
        }
        Ok(())
    }
}

impl Default for CalibrateOptions {
    fn default() -> Self {
        Self {
            most_frames: 1500,
            most_windows: 40,
            k1_sigma: 0.05,
            most_focal_sigma: 0.08,
            advanced: AdvancedCalibrateOptions::default(),
        }
    }
}
