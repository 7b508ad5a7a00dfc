//! Height of the road ahead over the plane of a frame.

/// Distances ahead at which the height is kept, and the step between them \[m\]: the curvature of roads hardly changes within one.
pub(crate) const PLACES: usize = 16;
pub(crate) const STEP_M: f64 = 5.0;

/// Height of the road over the plane of a frame every 5 m, from 5 m on
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RoadAhead {
    /// Height \[m\].
    pub(crate) rise_m: [f64; PLACES],
    /// Standard deviation of it \[m\].
    pub(crate) sigma_m: [f64; PLACES],
}

impl RoadAhead {
    /// Height over the plane at a distance ahead \[m\], and its change with the distance. Beyond the last place it goes on as there.
    pub fn rise(&self, ahead_m: f64) -> (f64, f64) {
        let (low_m, slope, over_m) = interval(&self.rise_m, 0.0, ahead_m);
        (low_m + slope * over_m, slope)
    }

    /// Standard deviation of that height \[m\]. Beyond the last place it grows as the square of the distance, as that of a curvature does.
    pub fn sigma_m(&self, ahead_m: f64) -> f64 {
        let last_m = STEP_M * PLACES as f64;
        let (low_m, slope, over_m) = interval(&self.sigma_m, self.sigma_m[0], ahead_m.min(last_m));
        (low_m + slope * over_m) * (ahead_m / last_m).max(1.0).powi(2)
    }
}

/// The value at the place before a distance, the slope from there and the distance from there. `first`: value at the camera.
fn interval(values: &[f64; PLACES], first: f64, ahead_m: f64) -> (f64, f64, f64) {
    let k = (ahead_m / STEP_M).floor().clamp(0.0, PLACES as f64 - 1.0) as usize;
    let low = if k == 0 { first } else { values[k - 1] };
    (low, (values[k] - low) / STEP_M, (ahead_m - STEP_M * k as f64).max(0.0))
}
