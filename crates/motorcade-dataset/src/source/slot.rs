//! Frames that should exist, and the place of their pixels.

use std::path::PathBuf;

use super::live_source::LiveSource;

/// One frame that should exist.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slot {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// The file; `None` for a gap in the numbering, and for frames of a video.
    pub path: Option<PathBuf>,
}

/// Storage of the pixels.
#[derive(Clone, Debug)]
pub(crate) enum Store {
    /// Each slot has its own file.
    Files,
    /// All slots are frames of one video, slot number = frame number.
    Video(PathBuf),
    /// Frames come as they are taken; there are no slots.
    Live(LiveSource),
}
