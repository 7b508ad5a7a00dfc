//! Results of a drive as its `run.json` records them.

use std::path::Path;

use motorcade::RunRecord;
use motorcade::output::RUN_RECORD;
use serde::{Deserialize, Serialize};

/// Figures of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Results {
    /// Frames of the run.
    pub frames: u64,
    /// Distance driven \[m\].
    pub length_m: Option<f64>,
    /// From the first to the last frame \[s\].
    pub duration_s: Option<f64>,
    /// Vehicles found.
    pub vehicles: u64,
    /// Warnings of the run.
    pub warnings: Vec<String>,
    /// Hash of all that decides the results.
    pub fingerprint: String,
}

/// Results found in a directory.
pub(crate) enum Found {
    /// No directory, or no record in it.
    Nothing,
    /// Those of a run that was stopped.
    Partial,
    /// Those of a whole run.
    Whole(Results),
}

/// Looks at the directory of a run.
pub(crate) fn read(directory: &Path) -> Found {
    if !directory.join(RUN_RECORD).exists() {
        return Found::Nothing;
    }
    // A record that does not read is no result that could be kept.
    let Ok(record) = RunRecord::read(directory) else { return Found::Partial };
    match (record.interrupted, record.fingerprint) {
        (Some(false), Some(fingerprint)) => Found::Whole(Results {
            frames: record.counters.frames,
            length_m: record.length_m,
            duration_s: record.input.duration_s,
            vehicles: record.counters.vehicles,
            warnings: record.warnings,
            fingerprint,
        }),
        _ => Found::Partial,
    }
}
