//! What the odometry says of every frame, up to scale.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Matrix6;

use crate::pose_only::PoseEstimate;

type CameraFromWorld = Pose<Camera, World>;
type CameraFromCamera = Pose<Camera, Camera>;

/// What is known of a frame's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameStatus {
    /// No map yet; the pose is filled in when one begins.
    Initialising,
    /// Tracked against the map.
    Tracked,
    /// The camera stood still: the pose of the frame before.
    Standstill,
    /// Not tracked (missing, corrupt, covered): bridged between its neighbours.
    Bridged,
}

/// A frame's pose, relative to a keyframe so that later adjustments move it along.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// How it was found.
    pub status: FrameStatus,
    /// Segment it belongs to.
    pub segment: usize,
    /// Keyframe number within the segment.
    pub keyframe: usize,
    /// Pose relative to that keyframe.
    pub camera_from_keyframe: CameraFromCamera,
    /// Landmarks that agreed.
    pub inliers: usize,
    /// Reprojection error of the inliers \[px\].
    pub rms_px: f64,
    /// Covariance of the pose against the map (6×6 `[ω, ν]`, translation in the segment's unit).
    pub covariance: Matrix6<f64>,
}

/// Frame poses of one segment, in the segment's own unit of length.
#[derive(Clone, Debug)]
pub struct UpToScale {
    /// One record a frame, in order.
    pub frames: Vec<FrameRecord>,
    /// `camera_from_world` of each keyframe of each segment.
    pub keyframes: Vec<Vec<CameraFromWorld>>,
}

impl UpToScale {
    /// A trajectory from elsewhere, as one segment in its own unit. `world_from_camera` of every frame.
    pub fn from_poses(poses: &[Pose<World, Camera>]) -> Self {
        let keyframes: Vec<CameraFromWorld> = poses.iter().map(Pose::inverse).collect();
        let frame = |keyframe: usize| {
            // What a good odometry errs from frame to frame: 0.02° and 1 % of the step.
            let step = keyframe
                .checked_sub(1)
                .map_or(0.0, |b| (poses[keyframe].translation() - poses[b].translation()).norm());
            let (turn, shift) = (0.02_f64.to_radians().powi(2), (0.01 * step).powi(2) + 1e-8);
            FrameRecord {
                status: FrameStatus::Tracked,
                segment: 0,
                keyframe,
                camera_from_keyframe: CameraFromCamera::identity(),
                inliers: 0,
                rms_px: 0.0,
                covariance: Matrix6::from_diagonal(&nalgebra::Vector6::new(
                    turn, turn, turn, shift, shift, shift,
                )),
            }
        };
        Self { frames: (0..poses.len()).map(frame).collect(), keyframes: vec![keyframes] }
    }

    /// `camera_from_world` of a frame in its segment's world; `None` while its segment has no map.
    pub fn camera_from_world(&self, frame: usize) -> Option<CameraFromWorld> {
        let record = self.frames.get(frame)?;
        let keyframe = self.keyframes.get(record.segment)?.get(record.keyframe)?;
        Some(record.camera_from_keyframe * *keyframe)
    }
}

pub(crate) fn fill(record: &mut FrameRecord, estimate: &PoseEstimate) {
    record.status = FrameStatus::Tracked;
    record.inliers = estimate.inlier_count;
    record.rms_px = estimate.inlier_rms_px;
    // A floor on the pixel noise: three points can fit perfectly.
    let sigma = estimate.inlier_rms_px.max(0.1);
    record.covariance = estimate.information.try_inverse().unwrap_or_else(Matrix6::zeros) * (sigma * sigma);
}
