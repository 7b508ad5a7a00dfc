//! What the odometry says of every frame, up to scale.

use std::collections::BTreeMap;

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Matrix6;

use crate::map::PoseEstimate;

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
pub struct OdometryTrajectory {
    /// One record a frame, in order.
    pub frames: Vec<FrameRecord>,
    /// `camera_from_world` of each keyframe of each segment.
    pub keyframes: Vec<Vec<CameraFromWorld>>,
}

impl OdometryTrajectory {
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

    /// The frames `range` alone, numbered from 0; of the keyframes those they need.
    pub fn window(&self, range: std::ops::Range<usize>) -> Self {
        let mut frames = self.frames[range].to_vec();
        let mut spans: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for record in frames.iter().filter(|r| r.segment < self.keyframes.len()) {
            let span = spans.entry(record.segment).or_insert((record.keyframe, record.keyframe));
            *span = (span.0.min(record.keyframe), span.1.max(record.keyframe));
        }
        for record in &mut frames {
            if let Some((own, (_, (first, _)))) = spans.iter().enumerate().find(|s| *s.1.0 == record.segment)
            {
                record.segment = own;
                record.keyframe -= first;
            }
        }
        let of = |(segment, (first, last)): (&usize, &(usize, usize))| {
            self.keyframes[*segment].iter().take(last + 1).skip(*first).copied().collect()
        };
        Self { frames, keyframes: spans.iter().map(of).collect() }
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

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::lie::se3;
    use nalgebra::Vector6;

    #[test]
    fn a_window_keeps_the_poses_of_its_frames() {
        let pose = |k: usize| -> CameraFromWorld {
            Pose::new(se3::exp(&(Vector6::new(0.01, 0.02, 0.0, 0.1, 0.0, 1.0) * k as f64)))
        };
        let record = |segment: usize, keyframe: usize, k: usize| FrameRecord {
            status: FrameStatus::Tracked,
            segment,
            keyframe,
            camera_from_keyframe: pose(k).cast::<Camera, Camera>(),
            inliers: k,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        };
        let lost = FrameRecord { status: FrameStatus::Initialising, ..record(usize::MAX, 0, 0) };
        let frames = vec![
            record(0, 0, 0),
            record(0, 1, 1),
            record(0, 1, 2),
            record(0, 3, 3),
            lost,
            record(1, 0, 4),
            record(1, 2, 5),
        ];
        let whole = OdometryTrajectory {
            frames,
            keyframes: vec![(0..5).map(pose).collect(), (5..9).map(pose).collect()],
        };
        for range in [0..7, 1..7, 2..4, 3..6, 4..7, 6..7] {
            let window = whole.window(range.clone());
            assert_eq!(window.frames.len(), range.len());
            for (own, k) in range.enumerate() {
                let same = window.camera_from_world(own).map(|p| *p.isometry())
                    == whole.camera_from_world(k).map(|p| *p.isometry());
                assert!(same, "frame {k}");
            }
        }
        assert!(whole.window(2..4).keyframes[0].len() == 3);
    }
}
