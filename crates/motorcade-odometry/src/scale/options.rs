//! Options of the metric scale.

use crate::road::ProfileOptions;

/// Metric scale and road over time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MetricOptions {
    /// Standard deviation of an error of log scale that a whole drive shares: moving shadows, crowns of streets, a camera
    /// whose height is known to a centimetre. Root mean square over the simulator's drives, and about that of two real ones.
    pub bias_sigma: f64,
    /// Standard deviation of log scale without any road measurement, about `guess_units`: a factor of 1.9.
    pub unknown_scale_sigma: f64,
    /// Standard deviation of the camera's speed while no motion was measured at all \[m/s\]: traffic.
    pub unknown_speed_sigma_mps: f64,
    /// Standard deviation of pitch and roll without any road measurement \[rad\]: a degree.
    pub unknown_tilt_sigma_rad: f64,
    /// Camera height before any measurement \[odometry units\]: the mean of eight rendered drives at 10 frames/s. Over those, four real roads and
    /// 50 frames/s the logarithm scatters by 0.64 about it; open roads have lower cameras in this unit, high frame rates higher ones.
    pub guess_units: f64,
    /// Variance of log scale of a trajectory that is metric.
    pub metric_variance: f64,
    /// Variance of pitch and roll without measurements under such a trajectory \[rad²\]: 0.5°, a camera mounted level.
    pub mounting_variance_rad2: f64,
    /// Standard deviation of the rotation over 0.1 s without a measured pose \[rad\]; its variance grows with time.
    pub unmeasured_rotation_sigma_rad: f64,
    /// Standard deviation of the motion over 0.1 s without a measured pose \[m\]: 1 m/s of change in speed.
    pub unmeasured_motion_sigma_m: f64,
    /// Standard deviation of the heading a second after the last pose of a map that ended \[rad\]; it grows with the time to the power of 1.5. Turns of
    /// streets: extrapolated, KITTI odometry 00, tracking 0001 and 0007 and a rendered block of houses are off by 0.03 to 0.08 rad (RMS) after 1 s,
    /// 0.36 to 0.76 after 4, 0.9 to 1.8 after 8.
    pub unseen_turn_rad: f64,
    /// Standard deviation of the acceleration after it \[m/s²\]: there, 0.4 to 0.5 m of way after 1 s, 5 to 7 after 4, 14 to 26 after 8.
    pub unseen_acceleration_mps2: f64,
    /// Floor of the variance of a step \[rad², m²\].
    pub least_step_variance: f64,
    /// Smoother.
    pub smoother: SmootherOptions,
    /// Curvature of the road.
    pub profile: ProfileOptions,
}

impl Default for MetricOptions {
    fn default() -> Self {
        Self {
            bias_sigma: 0.006,
            unknown_scale_sigma: 0.65,
            unknown_speed_sigma_mps: 15.0,
            unknown_tilt_sigma_rad: 1.0_f64.to_radians(),
            guess_units: 1.3,
            metric_variance: 1e-4,
            mounting_variance_rad2: 7.6e-5,
            unmeasured_rotation_sigma_rad: 0.5_f64.to_radians(),
            unmeasured_motion_sigma_m: 0.1,
            unseen_turn_rad: 0.07,
            unseen_acceleration_mps2: 1.0,
            least_step_variance: 1e-10,
            smoother: SmootherOptions::default(),
            profile: ProfileOptions::default(),
        }
    }
}

/// Smoother of scale, pitch and roll.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SmootherOptions {
    /// Candidates of the drift of log scale per √(camera height travelled); the likelihood chooses.
    pub drifts: [f64; 7],
    /// Candidates of the standard deviation of log scale of one frame beyond its pixels; the likelihood chooses.
    pub height_sigmas: [f64; 7],
    /// Correlation of pitch and roll over 0.1 s: a car body swings at 1–2 Hz.
    pub tilt_correlation: f64,
    /// Standard deviation of a frame's pitch beyond its pixels \[rad\]: a lane is not a plane to a tenth of a degree.
    pub pitch_floor_rad: f64,
    /// The same for roll, which a narrow lane with crown and ruts determines badly \[rad\]: 0.4°.
    pub roll_floor_rad: f64,
    /// Least standard deviation of pitch and roll over a drive \[rad\]: a stiff lorry.
    pub least_tilt_sigma_rad: f64,
    /// Greatest over least standard deviation of pitch and roll: a soft old car. Roll is measured badly, and its spread is mostly noise.
    pub tilt_sigma_range: f64,
    /// Mahalanobis distance beyond which a measurement loses weight: √ of the 95 % quantile of χ²₃.
    pub gate: f64,
    /// Degrees of freedom of the Student t distribution of the innovations.
    pub student_freedom: f64,
    /// Measurements whose median starts the filter.
    pub initial_measurements: usize,
    /// Least standard deviation of log scale at the start where the road measured it, 1 %: few measurements can agree by chance. Chosen, not
    /// measured: a smaller one holds the drive to its first measurements for longer.
    pub least_first_sigma: f64,
    /// Standard deviation of log scale at the start without measurements, and the most that the least one of a measurement counts as, 20 %.
    /// Chosen, not measured: a larger one trusts the first measurements more.
    pub first_sigma: f64,
    /// Length of road that one measurement covers \[camera heights\]: from the bonnet to the far end of the stretch.
    pub stretch_heights: f64,
    /// Time over which measurements share errors at most \[s\].
    pub shared_s: f64,
}

impl Default for SmootherOptions {
    fn default() -> Self {
        Self {
            drifts: [0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03],
            height_sigmas: [0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05],
            tilt_correlation: 0.7,
            pitch_floor_rad: 1.7e-3,
            roll_floor_rad: 7e-3,
            least_tilt_sigma_rad: 0.15_f64.to_radians(),
            tilt_sigma_range: 3.0,
            gate: 2.8,
            student_freedom: 4.0,
            initial_measurements: 15,
            least_first_sigma: 0.01,
            first_sigma: 0.2,
            stretch_heights: 11.0,
            shared_s: 2.0,
        }
    }
}
