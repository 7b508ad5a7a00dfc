//! Frames that are estimated together.

use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::GroundFrame;

use crate::record::FrameInfo;

/// The estimated rows of the last seconds, numbered from 0.
pub(super) struct Window {
    /// Place of its first frame among the estimated rows.
    pub(super) first: usize,
    /// Row of the run of each frame.
    pub(super) rows: Vec<usize>,
    pub(super) infos: Vec<FrameInfo>,
    pub(super) ego: EgoTrajectory,
    pub(super) grounds: Vec<GroundFrame>,
}

impl Window {
    /// Speed over the last interval: the window has one scale, which may be another one than that of the frame before when it was reported.
    pub(super) fn speed_mps(&self) -> f64 {
        let ([.., before, newest], [.., from, to]) = (&self.ego.frames[..], &self.infos[..]) else {
            return 0.0;
        };
        let step = newest.world_from_camera.translation() - before.world_from_camera.translation();
        speed_mps(step.norm(), (to.timestamp_ns - from.timestamp_ns) as f64 * 1e-9)
    }
}

/// Speed over a way; 0 in no time.
pub(super) fn speed_mps(way_m: f64, seconds: f64) -> f64 {
    if seconds > 0.0 { way_m / seconds } else { 0.0 }
}
