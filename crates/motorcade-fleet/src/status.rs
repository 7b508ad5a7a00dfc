//! Status of a drive.

use std::fmt;

use serde::{Deserialize, Serialize};

/// State of a drive after its last attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Results are written.
    Done,
    /// Results are written, but too many frames were not tracked (exit code 4).
    TrackingFailed,
    /// There are no results.
    Failed,
    /// Ended because it took longer than allowed.
    TimedOut,
    /// Ended because it took more memory than allowed.
    OutOfMemory,
    /// Stopped before its end, with the batch or by somebody else.
    Interrupted,
    /// Not begun.
    Pending,
}

impl Status {
    /// True when the drive has results.
    pub fn has_results(self) -> bool {
        matches!(self, Self::Done | Self::TrackingFailed)
    }

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::TrackingFailed => "tracking_failed",
            Self::Failed => "failed",
            Self::TimedOut => "timed_out",
            Self::OutOfMemory => "out_of_memory",
            Self::Interrupted => "interrupted",
            Self::Pending => "pending",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
