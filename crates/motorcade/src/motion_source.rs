//! Source of the camera's motion: the odometry, or a trajectory file.

use std::ops::Range;
use std::sync::Arc;

use image::GrayImage;
use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use motorcade_odometry::{
    ExternalTrajectoryOptions, FrameRecord, Odometry, OdometryOptions, OdometryState, OdometryTrajectory,
    Pyramid, RoadFeedback, ShiftedFrame, StaticMask,
};
use serde::{Deserialize, Serialize};

/// A camera trajectory from elsewhere, one pose a frame of the run.
#[derive(Clone, Debug)]
pub struct ExternalTrajectory {
    /// `world_from_camera` of each frame.
    pub world_from_camera: Vec<Pose<World, Camera>>,
    /// True when its lengths are metres; else the road gives the scale, or vehicles that stand.
    pub metric: bool,
}

impl ExternalTrajectory {
    /// The frames of a range as an odometry in metres, for a unit of so many.
    pub(crate) fn in_metres(
        &self,
        unit_m: f64,
        range: Range<usize>,
        timestamps_ns: &[i64],
        options: &ExternalTrajectoryOptions,
    ) -> OdometryTrajectory {
        let poses = self.world_from_camera.get(range).unwrap_or_default().iter().map(|p| p.scaled(unit_m));
        let metric = Self { world_from_camera: poses.collect(), metric: true };
        OdometryTrajectory::from_poses(&metric.unit_poses(), timestamps_ns, options)
    }

    /// Poses relative to the first one. Those of unknown scale get a unit near a metre, which the road search starts from.
    pub(crate) fn unit_poses(&self) -> Vec<Pose<World, Camera>> {
        let poses = &self.world_from_camera;
        let first = poses.first().map(Pose::inverse).unwrap_or_default();
        let relative: Vec<Pose<World, Camera>> =
            poses.iter().map(|p| first.cast::<World, World>() * *p).collect();
        if self.metric {
            return relative;
        }
        let mut steps: Vec<f64> =
            relative.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).collect();
        steps.sort_by(f64::total_cmp);
        // The upper quartile: a drive that mostly stands still moves in some frames.
        let typical = steps.get(steps.len() * 3 / 4).copied().filter(|s| *s > 0.0).unwrap_or(1.0);
        relative.iter().map(|p| p.scaled(1.0 / typical)).collect()
    }
}

/// Source of the camera's motion.
pub(crate) enum MotionSource {
    Own(Box<Odometry>),
    /// All poses, and the frames so far.
    External {
        poses: Vec<Pose<World, Camera>>,
        trajectory: OdometryTrajectory,
        /// Levels of the pyramids that the road is aligned on.
        pyramid_levels: usize,
        /// Uncertainty of the steps.
        options: ExternalTrajectoryOptions,
    },
}

/// State of the motion between two frames, without what the settings give.
#[derive(Serialize, Deserialize)]
pub(crate) enum MotionState {
    Own(Box<OdometryState>),
    External(OdometryTrajectory),
}

impl MotionSource {
    /// The state after the last frame.
    pub(crate) fn state(&self) -> MotionState {
        match self {
            Self::Own(odometry) => MotionState::Own(Box::new(odometry.state())),
            Self::External { poses: _, trajectory, pyramid_levels: _, options: _ } => {
                MotionState::External(trajectory.clone())
            }
        }
    }
    /// As in a state, with the settings of this one; `None` where one is external and the other one is not.
    pub(crate) fn resumed(&self, camera: PinholeCamera, state: MotionState) -> Option<Self> {
        match (self, state) {
            (Self::Own(own), MotionState::Own(state)) => {
                Some(Self::Own(Box::new(Odometry::from_state(camera, *own.options(), *state))))
            }
            (Self::External { poses, pyramid_levels, options, .. }, MotionState::External(trajectory)) => {
                Some(Self::External {
                    poses: poses.clone(),
                    trajectory,
                    pyramid_levels: *pyramid_levels,
                    options: *options,
                })
            }
            _ => None,
        }
    }
    pub(crate) fn external(trajectory: &ExternalTrajectory, options: &OdometryOptions) -> Self {
        Self::External {
            poses: trajectory.unit_poses(),
            trajectory: OdometryTrajectory::from_poses(&[], &[], &options.advanced.external),
            pyramid_levels: options.klt.advanced.pyramid_levels,
            options: options.advanced.external,
        }
    }
    pub(crate) fn process(
        &mut self,
        timestamp_ns: i64,
        image: &GrayImage,
        mask: &StaticMask<'_>,
    ) -> Arc<Pyramid> {
        match self {
            Self::Own(odometry) => odometry.process(timestamp_ns, image, mask),
            Self::External { poses, trajectory, pyramid_levels, options } => {
                trajectory.push_next_pose(poses, timestamp_ns, options);
                Arc::new(Pyramid::new(image, *pyramid_levels))
            }
        }
    }
    /// The odometry, where the motion is its own.
    pub(crate) fn odometry(&self) -> Option<&Odometry> {
        match self {
            Self::Own(odometry) => Some(odometry),
            Self::External { .. } => None,
        }
    }
    /// A frame without an image.
    pub(crate) fn skip(&mut self, timestamp_ns: i64) {
        match self {
            Self::Own(odometry) => odometry.skip(timestamp_ns),
            Self::External { poses, trajectory, options, .. } => {
                trajectory.push_next_pose(poses, timestamp_ns, options);
            }
        }
    }
    /// Frames that were taken and turned out to show nothing new.
    pub(crate) fn bridge_rows(&mut self, rows: Range<usize>) {
        if let Self::Own(odometry) = self {
            odometry.bridge_rows(rows);
        }
    }
    pub(crate) fn apply_road(&mut self, feedback: &RoadFeedback<'_>) {
        if let Self::Own(odometry) = self {
            odometry.apply_road(feedback);
        }
    }
    /// Takes out records that no later step needs, many at once. The poses of an external trajectory are in memory as a whole.
    pub(crate) fn forget_before(&mut self, row: usize) -> Vec<FrameRecord> {
        match self {
            Self::Own(odometry) => odometry.forget_before(row),
            Self::External { trajectory, .. } => {
                // The next pose is a step from the newest one.
                let newest = trajectory.frames.len().saturating_sub(1);
                trajectory.forget_before(row.min(newest))
            }
        }
    }
    /// Puts back the records that were taken out.
    pub(crate) fn put_back(&mut self, older: Vec<FrameRecord>) {
        match self {
            Self::Own(odometry) => odometry.put_back(older),
            Self::External { trajectory, .. } => trajectory.put_back(older),
        }
    }
    /// Frames after which the odometry started a new map because the unit of the old one was lost.
    pub(crate) fn renewals(&self) -> &[usize] {
        match self {
            Self::Own(odometry) => odometry.renewals(),
            Self::External { .. } => &[],
        }
    }
    /// Frames from which on the picture is shifted as a whole.
    pub(crate) fn shifted_frames(&self) -> &[ShiftedFrame] {
        match self {
            Self::Own(odometry) => odometry.shifted_frames(),
            Self::External { .. } => &[],
        }
    }
    pub(crate) fn trajectory(&self) -> &OdometryTrajectory {
        match self {
            Self::Own(odometry) => odometry.trajectory(),
            Self::External { trajectory, .. } => trajectory,
        }
    }
    /// All frames' motion.
    pub(crate) fn finish(self) -> OdometryTrajectory {
        match self {
            Self::Own(odometry) => odometry.finish(),
            Self::External { trajectory, .. } => trajectory,
        }
    }
}
