//! The run that is recorded.

use std::path::Path;

use motorcade::{RecordedFrame, RecordedRun};
use motorcade_geometry::PinholeCamera;

use crate::error::Error;
use crate::speeds::Speeds;

/// A run with its camera and its table of speeds.
pub(crate) struct Drive {
    pub(crate) camera: PinholeCamera,
    pub(crate) run: RecordedRun,
    pub(crate) speeds: Speeds,
    /// Index of the vehicle and of its state, by row.
    states: Vec<Vec<(usize, usize)>>,
}

impl Drive {
    /// The run in `directory`, whose frames `camera` took.
    pub(crate) fn new(directory: &Path, run: RecordedRun, camera: PinholeCamera) -> Result<Self, Error> {
        let speeds = Speeds::read(&directory.join("speeds.csv"))?;
        let mut states = vec![Vec::new(); run.frames.len()];
        for (v, vehicle) in run.vehicles.iter().enumerate() {
            for (s, state) in vehicle.states.iter().enumerate() {
                if let Some(row) = states.get_mut(state.row) {
                    row.push((v, s));
                }
            }
        }
        Ok(Self { camera, run, speeds, states })
    }

    /// The frame in a row.
    pub(crate) fn frame(&self, row: usize) -> Option<&RecordedFrame> {
        self.run.frames.get(row)
    }

    /// Index of each vehicle in a row and of its state.
    pub(crate) fn states(&self, row: usize) -> &[(usize, usize)] {
        self.states.get(row).map_or(&[], Vec::as_slice)
    }
}
