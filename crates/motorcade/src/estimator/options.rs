//! Windows of online runs.

use serde::{Deserialize, Serialize};

/// Windows of an online run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineOptions {
    /// True estimates every frame as it comes; false estimates the drive as a whole after the last one.
    pub enabled: bool,
    /// Frames of camera and vehicles that are estimated together.
    pub lag_frames: usize,
    /// Frames over which scale and road are smoothed, at least as many.
    pub scale_frames: usize,
    /// Iterations of the graph a frame, at most: it starts where the frame before ended.
    pub iterations: usize,
}

impl Default for OnlineOptions {
    fn default() -> Self {
        // 2.5 s: the time in which a vehicle shows whether it moves. 15 s: errors of scale last for several seconds.
        Self { enabled: false, lag_frames: 25, scale_frames: 150, iterations: 8 }
    }
}
