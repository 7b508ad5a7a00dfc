//! Options of the size shared by the frames of a track.

/// Weight and limits of the size that the boxes of a track agree on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SizeOptions {
    /// Views count as at most this many independent ones: a detector draws the same vehicle with the same bias every time.
    pub independent_views: f64,
    /// Largest deviation from the class mean, in its standard deviations: a box truncated by shadows must not shrink a car.
    pub limit_sigmas: f64,
    /// Standard deviation of the logarithm of the scale while the scale is held: small, but large enough for regular equations.
    pub held_scale_sigma: f64,
    /// Smallest standard deviation of a dimension \[m\]: the outline of a vehicle is not known better.
    pub least_sigma_m: f64,
}

impl Default for SizeOptions {
    fn default() -> Self {
        Self { independent_views: 12.0, limit_sigmas: 2.5, held_scale_sigma: 0.003, least_sigma_m: 0.02 }
    }
}
