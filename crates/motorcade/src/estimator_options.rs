//! Options of the estimator: windows of online runs, and the unit of an external trajectory.

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
    /// odometry, vehicles by their motion. Neighbouring boxes err alike, so that more of them tell little: a second of video
    /// costs the same at any frame rate.
    pub interval_s: f64,
    /// Iterations of the graph a frame, at most: it starts where the frame before ended.
    pub iterations: usize,
}

impl Default for OnlineOptions {
    fn default() -> Self {
        Self { enabled: false, lag_s: 2.5, scale_s: 15.0, interval_s: 0.07, iterations: 8 }
    }
}

/// Unit of an external trajectory of unknown scale, from vehicles that are taken for static.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UnitOptions {
    /// Vehicles that must agree: two may both be oncoming traffic.
    pub least_vehicles: usize,
    /// Views of a vehicle needed for its estimate.
    pub least_views: usize,
    /// Relative error common to the distances of one vehicle (size, pitch of the road), one standard deviation.
    pub vehicle_sigma: f64,
    /// Relative error common to all vehicles, one standard deviation: a level road is assumed (four KITTI drives from labelled boxes:
    /// 1 to 7 % too near).
    pub common_sigma: f64,
    /// Factor on the variances of views: errors of neighbouring frames are correlated.
    pub variance_factor: f64,
    /// Relative standard deviation from which on the estimate of a vehicle is left out.
    pub most_sigma: f64,
}

impl Default for UnitOptions {
    fn default() -> Self {
        Self {
            least_vehicles: 3,
            least_views: 8,
            vehicle_sigma: 0.07,
            common_sigma: 0.1,
            variance_factor: 4.0,
            most_sigma: 0.2,
        }
    }
}
