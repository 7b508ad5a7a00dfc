//! Distances that another sensor measured during a drive.

/// Distance travelled between two times, by a sensor other than the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredDistance {
    /// Begin by the clock of the sensor \[s\].
    pub from_s: f64,
    /// End by the same clock \[s\].
    pub to_s: f64,
    /// The distance \[m\].
    pub metres: f64,
    /// Its standard deviation, independent of that of other distances \[m\].
    pub sigma_m: f64,
    /// True for the straight line between both places, false for the length of the way.
    pub straight: bool,
}
