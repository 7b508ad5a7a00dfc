//! Earlier frames that the road of the current one is compared with.

use std::collections::VecDeque;
use std::sync::Arc;

use motorcade_geometry::{Camera, Pose, World};

use super::pixels::RoadPixels;
use crate::tracking::Pyramid;

/// An earlier frame.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct EarlierFrame {
    pub frame: usize,
    pub timestamp_ns: i64,
    #[serde(with = "crate::tracking::stored")]
    pub pyramid: Arc<Pyramid>,
    pub road: RoadPixels,
}

/// Earlier frames, oldest first.
#[derive(Default)]
pub(super) struct RoadHistory {
    frames: VecDeque<EarlierFrame>,
    spare: RoadPixels,
}

impl RoadHistory {
    /// With these frames, oldest first.
    pub fn of(frames: VecDeque<EarlierFrame>) -> Self {
        Self { frames, spare: RoadPixels::default() }
    }

    /// Removes and returns all frames.
    pub fn take(&mut self) -> VecDeque<EarlierFrame> {
        std::mem::take(&mut self.frames)
    }

    /// All frames, oldest first.
    pub fn frames(&self) -> &VecDeque<EarlierFrame> {
        &self.frames
    }

    /// Adds a frame.
    pub fn push(&mut self, frame: EarlierFrame) {
        self.frames.push_back(frame);
    }

    /// Removes the frames before a time.
    pub fn remove_before(&mut self, timestamp_ns: i64) {
        while self.frames.front().is_some_and(|f| f.timestamp_ns < timestamp_ns) {
            self.spare = self.frames.pop_front().map(|f| f.road).unwrap_or_default();
        }
    }

    /// Number of the oldest frame.
    pub fn oldest(&self) -> Option<usize> {
        self.frames.front().map(|f| f.frame)
    }

    /// Timestamp of the newest frame \[ns\].
    pub fn newest_ns(&self) -> Option<i64> {
        self.frames.back().map(|f| f.timestamp_ns)
    }

    /// Road pixels of a removed frame, to be refilled.
    pub fn take_spare(&mut self) -> RoadPixels {
        std::mem::take(&mut self.spare)
    }

    /// Earlier frames, newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = &EarlierFrame> {
        self.frames.iter().rev()
    }

    /// An earlier frame by its place, newest first.
    pub fn newest(&self, place: usize) -> Option<&EarlierFrame> {
        self.frames.iter().rev().nth(place)
    }

    /// The newest frame at least `least_baseline` away from `camera_from_world`, and `reference_from_current`.
    pub fn reference(
        &self,
        camera_from_world: &Pose<Camera, World>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
        least_baseline: f64,
    ) -> Option<(&EarlierFrame, Pose<Camera, Camera>)> {
        self.frames.iter().rev().find_map(|earlier| {
            // Eq. (2).
            let motion = pose_of(earlier.frame)? * camera_from_world.inverse();
            (motion.translation().norm() >= least_baseline).then_some((earlier, motion))
        })
    }
}
