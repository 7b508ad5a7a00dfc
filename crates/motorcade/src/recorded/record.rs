//! The record of a run.

use std::path::Path;

use motorcade_dataset::{Format, regular_file};
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::output::RUN_RECORD;

/// `run.json`, as far as other commands need it. Entries that an older or foreign record does not have are empty.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct RunRecord {
    /// Version of the program.
    pub motorcade: Option<String>,
    /// The command that was run, program first.
    pub command: Vec<String>,
    /// Hash of all that decides the results.
    pub fingerprint: Option<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: Option<bool>,
    /// Height of the camera above the road \[m\].
    pub camera_height_m: Option<f64>,
    /// Way of the camera \[m\].
    pub length_m: Option<f64>,
    /// Rectangles around what is fixed to the camera: left, top, right, bottom \[px\].
    pub fixed_regions_px: Vec<[f64; 4]>,
    /// Messages for the user.
    pub warnings: Vec<String>,
    /// Numbers of what it holds.
    pub counters: RecordedCounters,
    /// The input.
    pub input: RecordedInput,
}

/// Numbers of what a run holds.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct RecordedCounters {
    /// Frames.
    pub frames: u64,
    /// Vehicles.
    pub vehicles: u64,
}

/// The input of a run.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct RecordedInput {
    /// Kind of input.
    pub format: Option<Format>,
    /// Sequence of a KITTI tracking split.
    pub sequence: Option<String>,
    /// Camera of a KITTI rig.
    pub camera: Option<u8>,
    /// From the first to the last selected frame \[s\].
    pub duration_s: Option<f64>,
    /// First and last selected number.
    pub numbers: Option<(u64, u64)>,
    /// Width of the frames \[px\].
    pub width: Option<u32>,
    /// Height of the frames \[px\].
    pub height: Option<u32>,
    /// fx, fy, cx, cy \[px\].
    pub intrinsics_px: Option<[f64; 4]>,
}

impl RunRecord {
    /// Reads `run.json` of a run's directory.
    ///
    /// # Errors
    /// A file that is missing or is no record of a run.
    pub fn read(directory: &Path) -> Result<Self> {
        let path = directory.join(RUN_RECORD);
        let text = regular_file::read_to_string(&path)
            .map_err(|source| motorcade_dataset::Error::Io { path: path.clone(), source })?;
        serde_json::from_str(&text)
            .map_err(|e| Error::Input(format!("{}: is not the record of a run: {e}", path.display())))
    }
}
