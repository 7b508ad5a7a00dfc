//! Options of the estimator: windows of online runs, the unit of an external trajectory, the camera's height by vehicles, distances of another
//! sensor.

use serde::{Deserialize, Serialize};

/// Windows of an online run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineOptions {
    /// True estimates every frame as it comes; false estimates the drive as a whole after the last one.
    pub enabled: bool,
    /// Time over which camera and vehicles are estimated together \[s\]: that in which a moving vehicle is distinguished from a
    /// static one.
    pub lag_s: f64,
    /// Time over which scale and road are smoothed \[s\], at least as long: errors of scale last for several seconds.
    pub scale_s: f64,
    /// Least time between frames that are estimated in full \[s\]; frames between are predicted from the last such one, the camera by
    /// odometry, vehicles by their motion. Neighbouring boxes err alike, so that more of them add little: a second of video
    /// costs the same at any frame rate.
    pub interval_s: f64,
    /// Iterations of the graph a frame, at most: it starts where the frame before ended.
    pub iterations: usize,
    /// Standard deviation of a vehicle's acceleration in a frame that is predicted \[m/s²\]: firm braking. Larger values widen these frames.
    pub acceleration_sigma_mps2: f64,
    /// Memory, and places seen again while the camera drives.
    pub advanced: AdvancedOnlineOptions,
}

impl Default for OnlineOptions {
    fn default() -> Self {
        Self {
            enabled: false,
            lag_s: 2.5,
            scale_s: 15.0,
            interval_s: 0.07,
            iterations: 8,
            acceleration_sigma_mps2: 3.0,
            advanced: AdvancedOnlineOptions::default(),
        }
    }
}

/// Memory of an online run, and its corrections by places seen again. `most_visits` alone was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedOnlineOptions {
    /// Time beyond the longest window after which a frame is forgotten \[s\]: the road looks back less at the begin of the window
    /// (`road.advanced.oldest_s`). A longer one needs more memory.
    pub forget_after_s: f64,
    /// Way driven between two corrections by places seen again \[m\]: each solves the graph of its keyframes. A shorter one corrects sooner and costs
    /// time.
    pub least_correction_m: f64,
    /// Keyframes of places that a correction moves at least, where there are as many: 1.3 km. More spread a correction over more of the drive; its
    /// time grows in proportion.
    pub least_corrected_keyframes: usize,
    /// Keyframes that a correction moves before the last place that was seen again: they hold the others to what is known. More have the same effect.
    pub overlap_keyframes: usize,
    /// Visits of a place whose features are kept; each later one finds those. Memory grows with new streets alone then (a keyframe of 80 landmarks is
    /// 5 kB, and 6 kB in the index). Ten rendered rounds of a block, poses told, 1, 3 and all visits: 0.60, 0.56 and 0.56 m SE(3).
    pub most_visits: usize,
    /// Move of a keyframe from which on a correction names it \[m\]. A smaller one makes longer corrections.
    pub least_move_m: f64,
    /// Rotation of a keyframe from which on a correction names it \[rad\], with the same effect.
    pub least_move_rad: f64,
}

impl Default for AdvancedOnlineOptions {
    fn default() -> Self {
        Self {
            forget_after_s: 5.0,
            least_correction_m: 20.0,
            least_corrected_keyframes: 400,
            overlap_keyframes: 40,
            most_visits: 3,
            least_move_m: 0.05,
            least_move_rad: 0.002,
        }
    }
}

/// Unit of an external trajectory of unknown scale, from vehicles that are taken for static.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UnitOptions {
    /// Vehicles that must agree: two may both be oncoming traffic.
    pub least_vehicles: usize,
    /// Time for which a vehicle must be seen for its estimate \[s\].
    pub least_s: f64,
    /// Relative error common to the distances of one vehicle (size, pitch of the road), one standard deviation.
    pub vehicle_sigma: f64,
    /// Relative error common to all vehicles, one standard deviation: a level road is assumed (four KITTI drives from labelled boxes:
    /// 1 to 7 % too near).
    pub common_sigma: f64,
    /// Time over which errors of a vehicle's views are correlated \[s\]: information grows with time, not with the frame rate.
    pub correlation_time_s: f64,
    /// Relative standard deviation from which on the estimate of a vehicle is left out.
    pub most_sigma: f64,
}

impl Default for UnitOptions {
    fn default() -> Self {
        Self {
            least_vehicles: 3,
            least_s: 0.7,
            vehicle_sigma: 0.07,
            common_sigma: 0.1,
            correlation_time_s: 0.4,
            most_sigma: 0.2,
        }
    }
}

/// Height of the camera by the sizes of cars: estimated where it is unknown, compared with the stated one where it is not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleHeightOptions {
    /// True combines a stated height with the one by cars, by their variances, in drives that are estimated as a whole. Little
    /// changes where the height was measured (`scale.advanced.bias_sigma` is its standard deviation); a wrong one widens the answer.
    pub combined: bool,
    /// Standard deviation of the logarithm of the mean size of a country's cars, and of a detector's habit to draw boxes large or
    /// small: KITTI's labelled cars are 6 % smaller than the European models behind the shape prior.
    pub common_sigma: f64,
    /// Height from which an unknown one is sought, and the guess where few vehicles or none determine it \[m\]: a dash-cam's in a car.
    pub guess_m: f64,
    /// Standard deviation of the logarithm of a guessed height, where vehicles do not determine it: from a low car's 1.1 m to a lorry's 2.5 m.
    pub guess_sigma: f64,
    /// Choice of the cars, their scatter, and the comparison with a stated height.
    pub advanced: AdvancedVehicleHeightOptions,
}

/// Choice of the cars, their scatter, and the comparison with a stated height.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedVehicleHeightOptions {
    /// Cars from which an estimate stands alone. One by fewer is combined with the guess, and has twice the deviation: among so few no outlier is
    /// told from the others.
    pub least_vehicles: usize,
    /// Factor on the standard deviation where cars are fewer than `least_vehicles`, too few to tell outliers. A guess: a van that passes for a car is
    /// a quarter larger, two of `vehicle_sigma`.
    pub few_vehicles_factor: f64,
    /// Cars needed to doubt a stated height.
    pub least_for_disagreement: usize,
    /// Boxes of a car, at least, counted as at most one per correlation time (`vehicles.advanced.correlation_time_s`): half a second. Chosen, not
    /// measured: more leave out cars that pass closely.
    pub least_views: f64,
    /// Largest standard deviation of the logarithm of a car's size by the road.
    pub most_sigma: f64,
    /// Standard deviation of the logarithm of a car's size about the mean of all, with what its boxes err in common: 0.06 for the
    /// moving cars of KITTI 0005, more where saloons and large cars mix.
    pub vehicle_sigma: f64,
    /// Standard deviation of the road's slope from the own lane to a car beside it \[rad\]: parallel roads lie higher or lower.
    pub cross_fall_sigma_rad: f64,
    /// Scale of the Cauchy kernel [standard deviations]: vans that pass for cars.
    pub kernel_sigmas: f64,
    /// Deviation from a stated height that is reported [standard deviations].
    pub disagreement_sigmas: f64,
    /// Estimates of an unknown height, each from the one before: sizes are linear in the height only near the right one. Chosen, not measured: more take
    /// longer and start from worse guesses.
    pub rounds: usize,
}

impl Default for AdvancedVehicleHeightOptions {
    fn default() -> Self {
        Self {
            least_vehicles: 3,
            few_vehicles_factor: 2.0,
            least_for_disagreement: 8,
            least_views: 5.0,
            most_sigma: 0.3,
            vehicle_sigma: 0.12,
            cross_fall_sigma_rad: 0.04,
            kernel_sigmas: 2.0,
            disagreement_sigmas: 3.0,
            rounds: 4,
        }
    }
}

impl Default for VehicleHeightOptions {
    fn default() -> Self {
        Self {
            combined: false,
            common_sigma: 0.05,
            guess_m: 1.5,
            guess_sigma: 0.35,
            advanced: AdvancedVehicleHeightOptions::default(),
        }
    }
}

/// Metres by distances of another sensor (speeds, GPS), beside the height of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DistanceOptions {
    /// Relative error that all speeds of a record share, one standard deviation: worn and cold tyres, another size of wheel.
    pub speed_sigma: f64,
    /// Relative error that all distances between fixes of GPS share, one standard deviation: errors that last for minutes cancel, slopes and bends leave a rest.
    pub gps_sigma: f64,
    /// Distance of a GPS antenna from the camera \[m\]; it moves otherwise in bends.
    pub lever_m: f64,
    /// Standard deviation of the offset between the clocks of frames and sensor where none is stated \[s\]: both begin together. Chosen, not measured: a
    /// larger one finds greater offsets, and wrong ones in steady drives.
    pub clock_sigma_s: f64,
    /// Limits, outliers, and the search of the offset between clocks.
    pub advanced: AdvancedDistanceOptions,
}

/// Limits, outliers, and the search of the offset between clocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedDistanceOptions {
    /// Shorter distances are left out \[m\]: at walking pace a speed says little.
    pub least_m: f64,
    /// Scale of the Cauchy kernel [standard deviations]: fixes between houses.
    pub kernel_sigmas: f64,
    /// Deviation from the height that is reported [standard deviations].
    pub disagreement_sigmas: f64,
    /// Steps in which clock offsets are tried \[s\], half a frame at 10 frames/s. Shorter ones take longer and find the offset more exactly.
    pub clock_step_s: f64,
}

impl Default for AdvancedDistanceOptions {
    fn default() -> Self {
        Self { least_m: 2.0, kernel_sigmas: 2.0, disagreement_sigmas: 3.0, clock_step_s: 0.05 }
    }
}

impl Default for DistanceOptions {
    fn default() -> Self {
        Self {
            speed_sigma: 0.02,
            gps_sigma: 0.005,
            lever_m: 1.5,
            clock_sigma_s: 1.0,
            advanced: AdvancedDistanceOptions::default(),
        }
    }
}
