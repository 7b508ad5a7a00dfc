//! A frame of the metric trajectory.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::trajectory::FrameStatus;

/// A frame of the metric trajectory.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct EgoFrame {
    /// Pose \[m\]; the world is the camera of the first frame.
    pub world_from_camera: Pose<World, Camera>,
    /// Origin of the pose: tracked, standstill, bridged or filled in.
    pub status: FrameStatus,
    /// False where the motion from the frame before was filled in: across a break, or before initialisation.
    pub step_measured: bool,
    /// Covariance of the motion from the frame before (6×6 `[ω, ν]`, rad and m), in this camera's frame.
    pub step_covariance: Matrix6<f64>,
    /// Covariance of the pose in the world (6×6 `[ω, ν]`), accumulated from the first frame.
    pub covariance: Matrix6<f64>,
    /// Metres per unit of the odometry, α of eq. (5).
    pub scale: f64,
    /// Standard deviation of log scale.
    pub scale_sigma: f64,
    /// The part of it in `step_covariance`: the error that is independent of the neighbouring frames.
    pub scale_sigma_alone: f64,
    /// Correlation of its error with that of the frame before.
    pub scale_correlation: f64,
    /// Standard deviation of an additional error of log scale that all frames share.
    pub scale_bias_sigma: f64,
    /// True when this frame has a road measurement of its own.
    pub scale_measured: bool,
    /// Unit normal of the road towards the camera, camera frame.
    pub road_normal: Vector3<f64>,
    /// Covariance of pitch and roll of the road (2×2 in the upper left) \[rad²\].
    pub road_tilt_covariance: Matrix3<f64>,
    /// Landmarks that agree with the pose.
    pub inliers: usize,
}
