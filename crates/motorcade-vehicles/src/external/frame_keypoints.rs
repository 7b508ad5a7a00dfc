//! The keypoints of a track in one frame, ready to be fitted.

use motorcade_shape::Observation;

/// The keypoints of a track in one frame.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct FrameKeypoints {
    /// Index of their layout.
    pub layout: usize,
    pub observation: Observation,
}
