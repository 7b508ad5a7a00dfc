//! Outcome of an attempt at a drive.

use serde::{Deserialize, Serialize};

use crate::run_record::Results;
use crate::status::Status;

/// Outcome of the last attempt at a drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Status of the drive.
    pub status: Status,
    /// Exit code of the process; none when a signal ended it.
    pub exit_code: Option<i32>,
    /// Attempts at this row, those of earlier batches included.
    pub attempts: u32,
    /// Reason why there are no results.
    pub message: String,
    /// Time of the last attempt \[s\].
    pub wall_s: f64,
    /// Processor time of the process and those it waited for \[s\], where the system says.
    pub cpu_s: Option<f64>,
    /// Most resident memory of the process and those it started \[MB\], where the system says.
    pub peak_rss_mb: Option<f64>,
    /// The results.
    pub results: Option<Results>,
}

impl Outcome {
    pub(crate) fn pending(attempts: u32) -> Self {
        Self {
            status: Status::Pending,
            exit_code: None,
            attempts,
            message: String::new(),
            wall_s: 0.0,
            cpu_s: None,
            peak_rss_mb: None,
            results: None,
        }
    }
}
