//! Settings of the check of a stated focal length.

/// Check of a stated focal length by the turns of a drive.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FocalCheckOptions {
    /// Keyframes of a window: a turn at a crossing. More determine the focal length better and take longer.
    pub window_keyframes: usize,
    /// Windows kept, those in which the camera turns most. More take longer: four 0.3 to 0.4 s of the processor.
    pub most_windows: usize,
    /// Least turn of a window \[rad\]: focal length and depth are one in a straight drive. Less takes windows that determine nothing.
    pub least_turn_rad: f64,
    /// Turn of a new window over that of the window it replaces, at least. Of many equal turns the largest are those whose rotation
    /// errs most: less chooses them, and a long drive doubts a true focal length.
    pub more_turn: f64,
    /// Corners of a window, those that are followed longest.
    pub most_corners: usize,
    /// Iterations of each of the two adjustments at most.
    pub max_iterations: usize,
    /// Difference of the logarithms of fx and fy of square pixels: others are not checked, as one focal length is estimated.
    pub square: f64,
    /// Standard deviation of the prior of ln f around the stated one: wide, so that the drive decides.
    pub log_focal_sigma: f64,
    /// Standard deviations by which the stated focal length and that of the drive differ when one of them is wrong. Less doubts true ones:
    /// none of 18 drives at 3.
    pub disagreement_sigmas: f64,
    /// Least difference of their logarithms that is reported: turns of cameras whose calibration is right err by up to 2.4 %.
    pub disagreement: f64,
}

impl Default for FocalCheckOptions {
    fn default() -> Self {
        Self {
            window_keyframes: 24,
            most_windows: 4,
            least_turn_rad: 0.15,
            more_turn: 1.25,
            most_corners: 160,
            max_iterations: 12,
            square: 0.01,
            log_focal_sigma: 0.5,
            disagreement_sigmas: 3.0,
            disagreement: 0.03,
        }
    }
}

impl FocalCheckOptions {
    /// The first setting out of its range; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        for (name, value, least) in [
            ("window_keyframes", self.window_keyframes, 6),
            ("most_windows", self.most_windows, 1),
            ("most_corners", self.most_corners, 20),
            ("max_iterations", self.max_iterations, 1),
        ] {
            if value < least {
                return Err(format!("{name} must be at least {least}, got {value}"));
            }
        }
        for (name, value) in [
            ("least_turn_rad", self.least_turn_rad),
            ("more_turn", self.more_turn),
            ("log_focal_sigma", self.log_focal_sigma),
            ("disagreement_sigmas", self.disagreement_sigmas),
            ("disagreement", self.disagreement),
        ] {
            if value <= 0.0 {
                return Err(format!("{name} must be positive, got {value}"));
            }
        }
        Ok(())
    }
}
