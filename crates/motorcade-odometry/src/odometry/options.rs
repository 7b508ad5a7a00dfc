//! Settings of the odometry.

use crate::map::PoseOnlyOptions;
use crate::map::WindowOptions;
use crate::tracking::CornerOptions;
use crate::tracking::KltOptions;

/// All settings of the odometry.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryOptions {
    /// Corner detection.
    pub corners: CornerOptions,
    /// Tracking.
    pub klt: KltOptions,
    /// Pose against the map.
    pub pose: PoseOnlyOptions,
    /// Local map.
    pub window: WindowOptions,
    /// Keyframes and breaks.
    pub policy: PolicyOptions,
    /// Seed of the two-view sampling.
    pub seed: u64,
}

/// When to begin, to take a keyframe, to give up.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PolicyOptions {
    /// Median image motion that lets a map begin \[rad, pixels over focal length\]: a degree, 12 px of a KITTI camera.
    pub begin_flow_rad: f64,
    /// Tracks a map begins with at least.
    pub begin_tracks: usize,
    /// Median image motion of landmarks since the last keyframe that asks for another \[rad\]: 30 px of a KITTI camera.
    pub keyframe_flow_rad: f64,
    /// Share of the last keyframe's landmarks still tracked below which another is taken.
    pub keyframe_kept: f64,
    /// Median image motion below which the camera is standing \[px\]: above the noise of tracking.
    pub standstill_px: f64,
    /// Landmarks that must agree on a pose.
    pub least_inliers: usize,
    /// Failed frames in a row after which a new segment begins.
    pub give_up_after: usize,
}

impl Default for PolicyOptions {
    fn default() -> Self {
        Self {
            begin_flow_rad: 0.0166,
            begin_tracks: 60,
            keyframe_flow_rad: 0.0416,
            keyframe_kept: 0.5,
            standstill_px: 0.25,
            least_inliers: 15,
            give_up_after: 5,
        }
    }
}
