//! Focal length that the turns of a drive say.

use std::fmt;

use motorcade_calibrate::FocalCheckOptions;

/// Focal length that the turns of a drive say, to hold against the stated one.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FocalByTurns {
    /// Focal length of the calibration \[px\].
    pub stated_px: f64,
    /// Focal length by the turns \[px\].
    pub px: f64,
    /// Its standard deviation \[px\].
    pub sigma_px: f64,
    /// Least error of the stated one that would be told, as a share: below it, all distances may be wrong by as much and nothing says so.
    pub least_error_told: f64,
}

impl FocalByTurns {
    /// Of a stated focal length and the one found, with its standard deviation \[px\].
    pub(crate) fn new(stated_px: f64, px: f64, sigma_px: f64, options: &FocalCheckOptions) -> Self {
        let least_error_told = options.disagreement.max(options.disagreement_sigmas * sigma_px / px);
        Self { stated_px, px, sigma_px, least_error_told }
    }

    /// True where the turns contradict the stated focal length.
    pub(crate) fn contradicts(&self) -> bool {
        (self.px / self.stated_px).ln().abs() > self.least_error_told
    }
}

impl fmt::Display for FocalByTurns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stated_px, px, sigma_px, least_error_told } = self;
        write!(
            f,
            "{stated_px:.0} px stated, {px:.0} ± {sigma_px:.0} px by the turns: an error below {:.0} % is not noticed",
            100.0 * least_error_told
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stated_focal_length_is_doubted_beyond_the_least_error_told() {
        let options = FocalCheckOptions::default();
        let found = FocalByTurns::new(758.0, 702.0, 19.0, &options);
        assert_eq!(
            found.to_string(),
            "758 px stated, 702 ± 19 px by the turns: an error below 8 % is not noticed"
        );
        assert!(!found.contradicts());
        assert!(FocalByTurns::new(758.0, 702.0, 15.0, &options).contradicts());
        // However well it is determined, 3 % are.
        assert!(!FocalByTurns::new(720.0, 702.0, 1.0, &options).contradicts());
    }
}
