//! Options of vehicle headings.

/// Headings from travel, from boxes and from external poses, and their uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HeadingOptions {
    /// Speed below which the heading is held: the direction of travel is undefined at a stop \[m/s\].
    pub hold_speed_mps: f64,
    /// Time over which external headings are averaged \[s\]: single-view headings scatter by degrees and flip now and then.
    pub averaging_time_s: f64,
    /// Most external headings that are averaged, spread over that time.
    pub averaged_views: usize,
    /// Orientations tried for a static vehicle, evenly over half a turn.
    pub orientations: usize,
    /// Boxes of a track that are compared at each of them.
    pub compared_boxes: usize,
    /// Cost \[χ²\] of standing across the road: most vehicles are parked along it.
    pub across_cost: f64,
    /// Cost \[χ²\] of an oblique orientation, at 45°: rare, and the one boxes constrain least.
    pub oblique_cost: f64,
    /// Lateral distance beyond which a parked vehicle faces as the traffic of its side does \[m\].
    pub roadside_m: f64,
    /// Standard deviation of the heading of a box, from travel or parking direction \[rad\].
    pub box_sigma_rad: f64,
    /// Standard deviation of roll and pitch of a vehicle against the plane in one frame \[rad\]: cross-fall and crown.
    pub tilt_sigma_rad: f64,
    /// Smallest standard deviation of the heading of a smoothed state \[rad\].
    pub state_sigma_rad: f64,
    /// Largest standard deviation of the heading of a smoothed state \[rad\].
    pub state_most_sigma_rad: f64,
    /// Standard deviation of roll and pitch of a smoothed state \[rad\].
    pub state_tilt_sigma_rad: f64,
    /// Growth of the heading's standard deviation with the time between states \[rad/s\].
    pub state_drift_radps: f64,
    /// Shortest time over which yaw rates are measured \[s\]: single-view headings are noisy at high frame rates. Longer times smooth
    /// the yaw rate.
    pub yaw_rate_time_s: f64,
}

impl Default for HeadingOptions {
    fn default() -> Self {
        Self {
            hold_speed_mps: 1.5,
            averaging_time_s: 0.9,
            averaged_views: 9,
            orientations: 12,
            compared_boxes: 12,
            across_cost: 2.0,
            oblique_cost: 2.0,
            roadside_m: 2.0,
            box_sigma_rad: 0.035,
            tilt_sigma_rad: 0.03,
            state_sigma_rad: 2.0_f64.to_radians(),
            state_most_sigma_rad: 1.0,
            state_tilt_sigma_rad: 2.0_f64.to_radians(),
            state_drift_radps: 0.01,
            yaw_rate_time_s: 0.1,
        }
    }
}
