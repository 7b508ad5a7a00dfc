//! Camera poses of all frames, up to scale.

use std::collections::BTreeMap;
use std::ops::Range;

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix6, Vector6};

use crate::rows::Rows;
use crate::time::{calibrated, ratio};

type CameraFromWorld = Pose<Camera, World>;
type CameraFromCamera = Pose<Camera, Camera>;

/// Origin of the pose of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct FrameRecord {
    /// Time of the frame \[ns\].
    pub timestamp_ns: i64,
    /// Source of the pose.
    pub status: FrameStatus,
    /// Segment it belongs to.
    pub segment: usize,
    /// Keyframe number within the segment.
    pub keyframe: usize,
    /// Pose relative to that keyframe.
    pub camera_from_keyframe: CameraFromCamera,
    /// Landmarks that agree with the pose.
    pub inliers: usize,
    /// Reprojection error of the inliers \[px\].
    pub rms_px: f64,
    /// Covariance of the motion from the frame before (6×6 `[ω, ν]`, translation in the segment's unit). Errors of consecutive
    /// poses against the same map are anti-correlated; what accumulates is a random walk over time, so this is the covariance
    /// of the pose against the map times the interval over 0.1 s.
    pub covariance: Matrix6<f64>,
}

impl FrameRecord {
    /// True when its pose against the map was measured.
    pub fn is_measured(&self) -> bool {
        matches!(self.status, FrameStatus::Tracked | FrameStatus::Standstill)
    }

    /// The record of a frame that belongs to no segment.
    pub fn unplaced(timestamp_ns: i64) -> Self {
        Self {
            timestamp_ns,
            status: FrameStatus::Initialising,
            segment: usize::MAX,
            keyframe: 0,
            camera_from_keyframe: CameraFromCamera::identity(),
            inliers: 0,
            rms_px: 0.0,
            covariance: Matrix6::zeros(),
        }
    }
}

/// Frame poses, each segment in its own unit of length.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct OdometryTrajectory {
    /// One record a frame, in order.
    pub frames: Rows<FrameRecord>,
    /// `camera_from_world` of each keyframe of each segment.
    pub keyframes: Vec<Vec<CameraFromWorld>>,
    /// Time of the last measured pose among the frames that are forgotten, or that lie before a window \[ns\].
    pub measured_before_ns: Option<i64>,
}

impl OdometryTrajectory {
    /// An external trajectory as one segment in its own unit: `world_from_camera` and time \[ns\] of every frame. The shorter
    /// list counts.
    pub fn from_poses(
        poses: &[Pose<World, Camera>],
        timestamps_ns: &[i64],
        options: &ExternalTrajectoryOptions,
    ) -> Self {
        let mut out = Self { keyframes: vec![Vec::new()], ..Self::default() };
        timestamps_ns.iter().for_each(|timestamp_ns| out.push_next_pose(poses, *timestamp_ns, options));
        out
    }

    /// Adds the next frame of an external trajectory, `poses[k]` for frame k; without one left nothing is added. Every frame is
    /// a keyframe.
    pub fn push_next_pose(
        &mut self,
        poses: &[Pose<World, Camera>],
        timestamp_ns: i64,
        options: &ExternalTrajectoryOptions,
    ) {
        let keyframe = self.frames.len();
        let (Some(pose), Some(keyframes)) = (poses.get(keyframe), self.keyframes.last_mut()) else { return };
        let before = keyframe.checked_sub(1);
        let step = before.map_or(0.0, |b| (pose.translation() - poses[b].translation()).norm());
        let interval = before.map_or(1.0, |b| calibrated(timestamp_ns - self.frames[b].timestamp_ns));
        keyframes.push(pose.inverse());
        self.frames.push(FrameRecord {
            timestamp_ns,
            status: FrameStatus::Tracked,
            segment: 0,
            keyframe,
            camera_from_keyframe: CameraFromCamera::identity(),
            inliers: 0,
            rms_px: 0.0,
            covariance: external_covariance(step, interval, options),
        });
    }

    /// Bridges frames evenly from the one before them to the one after, where both have a pose in one map; else they have none of their own.
    pub(crate) fn bridge(&mut self, rows: Range<usize>) {
        let ends = rows.start.checked_sub(1).and_then(|before| {
            let (from, to) = (self.frames.get(before)?, self.frames.get(rows.end)?);
            let step = self.camera_of(to)? * self.camera_of(from)?.inverse();
            (from.segment == to.segment).then(|| (from.clone(), to.timestamp_ns, step.log()))
        });
        for row in rows {
            let Some(record) = self.frames.get(row) else { continue };
            let bridged = match &ends {
                Some((from, to_ns, step)) => {
                    let along = ratio(record.timestamp_ns - from.timestamp_ns, to_ns - from.timestamp_ns);
                    FrameRecord {
                        timestamp_ns: record.timestamp_ns,
                        status: FrameStatus::Bridged,
                        camera_from_keyframe: CameraFromCamera::exp(&(step * along))
                            * from.camera_from_keyframe,
                        inliers: 0,
                        rms_px: 0.0,
                        covariance: Matrix6::zeros(),
                        ..*from
                    }
                }
                None => FrameRecord::unplaced(record.timestamp_ns),
            };
            self.frames[row] = bridged;
        }
    }

    /// Takes out the frames before `row`, many at once.
    pub fn forget_before(&mut self, row: usize) -> Vec<FrameRecord> {
        let forgotten: Vec<FrameRecord> = self.frames.forget_before(row).collect();
        let measured = forgotten.iter().rfind(|f| f.is_measured());
        self.measured_before_ns = measured.map(|f| f.timestamp_ns).or(self.measured_before_ns);
        forgotten
    }

    /// Puts back all frames that were taken out.
    pub fn put_back(&mut self, older: Vec<FrameRecord>) {
        self.frames.put_back(older);
        self.measured_before_ns = None;
    }

    /// The frames `range`, numbered from 0, and the keyframes they need.
    pub fn window(&self, range: Range<usize>) -> Self {
        let before = self.frames.kept()[..range.start - self.frames.first_kept()].iter();
        let measured = before.rev().find(|f| f.is_measured()).map(|f| f.timestamp_ns);
        let measured_before_ns = measured.or(self.measured_before_ns);
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
        Self { frames: frames.into(), keyframes: spans.iter().map(of).collect(), measured_before_ns }
    }

    /// `camera_from_world` of a frame in its segment's world; `None` while its segment has no map.
    pub fn camera_from_world(&self, frame: usize) -> Option<CameraFromWorld> {
        self.camera_of(self.frames.get(frame)?)
    }

    /// The same of a record that may be forgotten here.
    pub fn camera_of(&self, record: &FrameRecord) -> Option<CameraFromWorld> {
        let keyframe = self.keyframes.get(record.segment)?.get(record.keyframe)?;
        Some(record.camera_from_keyframe * *keyframe)
    }

    /// The same, without poses that were only filled in before a map: no base to measure from.
    pub fn measured_pose(&self, frame: usize) -> Option<CameraFromWorld> {
        let measured = self.frames.get(frame).is_some_and(|f| f.status != FrameStatus::Initialising);
        self.camera_from_world(frame).filter(|_| measured)
    }
}

/// Uncertainty of a trajectory that comes from elsewhere in place of the odometry, whose file states none. A larger one lets vehicles and places
/// correct the trajectory more.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ExternalTrajectoryOptions {
    /// Standard deviation of the rotation over 0.1 s \[rad\], 0.02°: that of our odometry. Chosen for files that state none.
    pub rotation_sigma_rad: f64,
    /// Standard deviation of a step over 0.1 s as a share of its length: that of a good odometry. Chosen, not measured.
    pub step_sigma_share: f64,
}

impl Default for ExternalTrajectoryOptions {
    fn default() -> Self {
        Self { rotation_sigma_rad: 0.02_f64.to_radians(), step_sigma_share: 0.01 }
    }
}

/// Covariance of a step of an external trajectory over an interval \[0.1 s\], the same random walk at all frame rates.
fn external_covariance(step: f64, interval: f64, options: &ExternalTrajectoryOptions) -> Matrix6<f64> {
    let interval = if interval > 0.0 { interval } else { 1.0 };
    let turn = options.rotation_sigma_rad.powi(2) * interval;
    let shift = (options.step_sigma_share * step).powi(2) / interval + 1e-8 * interval;
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::lie::se3;

    #[test]
    fn frames_that_repeat_go_evenly_to_the_next_one() {
        let pose =
            |s: f64| -> CameraFromWorld { Pose::exp(&(Vector6::new(0.01, 0.02, 0.0, 0.1, 0.0, 1.0) * s)) };
        let at = |s: f64, k: i64| FrameRecord {
            status: FrameStatus::Tracked,
            segment: 0,
            camera_from_keyframe: pose(s).cast::<Camera, Camera>(),
            ..FrameRecord::unplaced(k * 33_000_000)
        };
        let keyframes = vec![vec![CameraFromWorld::identity()]];
        let frames: Vec<_> = [(0.0, 0), (0.0, 1), (0.1, 2), (3.0, 3), (3.1, 4)].map(|(s, k)| at(s, k)).into();
        let mut whole = OdometryTrajectory { frames: frames.clone().into(), keyframes, ..Default::default() };
        whole.bridge(1..3);
        for (k, s) in [(0, 0.0), (1, 1.0), (2, 2.0), (3, 3.0), (4, 3.1)] {
            let off = whole.camera_from_world(k).unwrap() * pose(s).inverse();
            assert!(off.log().norm() < 1e-9, "{k}: {off:?}");
            let bridged = whole.frames[k].status == FrameStatus::Bridged;
            assert_eq!(bridged, (1..3).contains(&k));
        }
        // Before there is a map they have no pose.
        let mut begun = OdometryTrajectory { frames: frames.into(), ..Default::default() };
        begun.bridge(1..3);
        assert!(begun.frames[1].segment == usize::MAX && begun.frames[3].segment == 0);
    }

    #[test]
    fn the_last_measured_pose_is_known_when_it_is_forgotten() {
        let record = |k: i64| FrameRecord {
            status: if k < 300 { FrameStatus::Tracked } else { FrameStatus::Initialising },
            ..FrameRecord::unplaced(k)
        };
        let mut trajectory = OdometryTrajectory {
            frames: (0..600).map(record).collect::<Vec<_>>().into(),
            ..Default::default()
        };
        assert_eq!(trajectory.window(200..600).measured_before_ns, Some(199));
        let forgotten = trajectory.forget_before(500);
        assert!(trajectory.frames.first_kept() == 500);
        assert_eq!(trajectory.window(510..600).measured_before_ns, Some(299));
        trajectory.put_back(forgotten);
        assert_eq!((trajectory.frames.first_kept(), trajectory.measured_before_ns), (0, None));
    }

    #[test]
    fn a_window_keeps_the_poses_of_its_frames() {
        let pose = |k: usize| -> CameraFromWorld {
            Pose::new(se3::exp(&(Vector6::new(0.01, 0.02, 0.0, 0.1, 0.0, 1.0) * k as f64)))
        };
        let record = |segment: usize, keyframe: usize, k: usize| FrameRecord {
            timestamp_ns: k as i64 * 100_000_000,
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
            frames: frames.into(),
            keyframes: vec![(0..5).map(pose).collect(), (5..9).map(pose).collect()],
            measured_before_ns: None,
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

    #[test]
    fn errors_of_an_external_trajectory_accumulate_with_time_not_with_frames() {
        // Ten seconds at 10 m/s.
        let summed = |rate: usize| {
            let count = 10 * rate;
            let position = |k: usize| Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * k as f64 / rate as f64);
            let poses: Vec<Pose<World, Camera>> = (0..count).map(|k| Pose::exp(&position(k))).collect();
            let timestamps_ns: Vec<i64> = (0..count).map(|k| (k * 1_000_000_000 / rate) as i64).collect();
            let trajectory =
                OdometryTrajectory::from_poses(&poses, &timestamps_ns, &ExternalTrajectoryOptions::default());
            trajectory.frames.iter().skip(1).map(|f| f.covariance).sum::<Matrix6<f64>>()
        };
        let reference = summed(10);
        for rate in [5, 25, 50] {
            let ratio = summed(rate).component_div(&reference).diagonal();
            assert!(ratio.iter().all(|r| (r - 1.0).abs() < 0.03), "{rate}: {ratio}");
        }
    }
}
