//! A run's directory read back: its record and its tables.

mod frames;
mod record;
mod table;
mod vehicles;

use std::path::Path;

pub use frames::RecordedFrame;
pub use record::{RecordedInput, RunRecord};
pub use vehicles::{RecordedState, RecordedVehicle};

use crate::error::Result;

/// Camera and vehicles of a run, from `frames.csv`, `ego.tum`, `ego_covariance.csv` and `tracks.csv`.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// Frames in order; row k of the run is entry k.
    pub frames: Vec<RecordedFrame>,
    /// Vehicles by identity.
    pub vehicles: Vec<RecordedVehicle>,
}

impl RecordedRun {
    /// Reads the tables of a run's directory.
    ///
    /// # Errors
    /// A file that is missing or does not read, tables of different lengths, a vehicle in a frame the run does not have.
    pub fn read(directory: &Path) -> Result<Self> {
        let frames = frames::read(directory)?;
        let vehicles = vehicles::read(&directory.join("tracks.csv"), &frames)?;
        Ok(Self { frames, vehicles })
    }

    /// Row of the frame with this number of the input.
    pub fn row(&self, number: u64) -> Option<usize> {
        // Numbers of an input increase.
        self.frames.binary_search_by_key(&number, |f| f.number).ok()
    }
}
