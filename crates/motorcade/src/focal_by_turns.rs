//! Focal length that the turns of a drive say.

/// Focal length that the turns of a drive say, to hold against the stated one.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FocalByTurns {
    /// Focal length of the calibration \[px\].
    pub stated_px: f64,
    /// Focal length by the turns \[px\].
    pub px: f64,
    /// Its standard deviation \[px\].
    pub sigma_px: f64,
}
