//! Records of the frames.

use nalgebra::Matrix6;

use super::{CameraFromCamera, CameraFromWorld, Odometry};
use crate::map::PoseEstimate;
use crate::time::calibrated;
use crate::trajectory::{FrameRecord, FrameStatus};

impl Odometry {
    /// Time since the frame before the next record \[ns\].
    pub(super) fn since_last_record_ns(&self, timestamp_ns: i64) -> i64 {
        self.trajectory.frames.last().map_or(0, |f| timestamp_ns - f.timestamp_ns)
    }

    pub(super) fn record_initialising(&mut self, timestamp_ns: i64) {
        self.trajectory.frames.push(FrameRecord::unplaced(timestamp_ns));
    }

    /// The newest record belongs to no segment yet.
    pub(super) fn mark_newest_initialising(&mut self) {
        if let Some(record) = self.trajectory.frames.last_mut() {
            record.segment = usize::MAX;
            record.status = FrameStatus::Initialising;
            record.camera_from_keyframe = CameraFromCamera::identity();
        }
    }

    pub(super) fn record_tracked(
        &mut self,
        timestamp_ns: i64,
        estimate: &PoseEstimate,
        pose: CameraFromWorld,
        status: FrameStatus,
    ) {
        let interval_ns = self.since_last_record_ns(timestamp_ns);
        let Some(newest) = self.window.newest() else { return };
        let mut record = FrameRecord {
            timestamp_ns,
            status,
            segment: self.trajectory.keyframes.len() - 1,
            keyframe: newest.number,
            camera_from_keyframe: pose * newest.camera_from_world.inverse(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        };
        self.fill_estimate(&mut record, estimate, interval_ns);
        self.trajectory.frames.push(record);
    }

    /// Puts evidence and covariance of an estimate into a record, `interval_ns` after the one before.
    pub(super) fn fill_estimate(&self, record: &mut FrameRecord, estimate: &PoseEstimate, interval_ns: i64) {
        record.inliers = estimate.inlier_count;
        record.rms_px = estimate.inlier_rms_px;
        let sigma = estimate.inlier_rms_px.max(self.options.advanced.pose.least_sigma_px);
        let against_map = estimate.information.try_inverse().unwrap_or_else(Matrix6::zeros) * (sigma * sigma);
        record.covariance = against_map * calibrated(interval_ns);
    }

    /// Records a frame at constant velocity.
    pub(super) fn bridge(&mut self, timestamp_ns: i64) {
        let interval_ns = self.since_last_record_ns(timestamp_ns);
        let before = self.trajectory.frames.last();
        let moved = before.map_or(CameraFromCamera::identity(), |b| {
            self.velocity.over(interval_ns.max(0)) * b.camera_from_keyframe
        });
        let (segment, keyframe) = before.map_or((usize::MAX, 0), |b| (b.segment, b.keyframe));
        self.trajectory.frames.push(FrameRecord {
            timestamp_ns,
            status: FrameStatus::Bridged,
            segment,
            keyframe,
            camera_from_keyframe: moved,
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        });
    }
}
