//! The keypoints of a track in one frame, ready to be fitted.

use motorcade_shape::Observation;

/// The keypoints of a track in one frame.
pub(super) struct FrameKeypoints {
    /// Index of their layout.
    pub layout: usize,
    pub observation: Observation,
}
