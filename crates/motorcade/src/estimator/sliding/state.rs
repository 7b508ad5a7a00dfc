//! State of the estimator over the last seconds, to be kept in a file.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use motorcade_multibody::{MultibodyGraph, MultibodyGraphState};
use motorcade_odometry::Uncertainty;
use motorcade_vehicles::{KeypointTrack, TrackerState, VehicleTrajectory};
use serde::{Deserialize, Serialize};

use super::{Placed, SlidingEstimator};
use crate::error::{Error, Result};
use crate::estimator::ego_archive::{EgoArchive, EgoArchiveState};
use crate::estimator::online_loops::OnlineLoopsState;
use crate::estimator::remembered::Remembered;
use crate::estimator::unit::{Unit, UnitState};
use crate::estimator::vehicle_archive::{VehicleArchive, VehicleArchiveState};
use crate::revision::Revision;
use crate::settings::Settings;
use crate::timing::Stopwatch;

/// State of a [`SlidingEstimator`] between two frames, without what the settings give.
#[derive(Serialize, Deserialize)]
pub(crate) struct SlidingState<'a> {
    tracker: TrackerState,
    graph: Option<MultibodyGraphState>,
    estimated: Vec<usize>,
    placed: Placed,
    entries: (usize, VecDeque<Uncertainty>),
    remembered: Option<Remembered>,
    keypoints: BTreeMap<usize, KeypointTrack>,
    units: UnitState,
    unit: Option<Unit>,
    ego: EgoArchiveState,
    vehicles: BTreeMap<usize, VehicleTrajectory>,
    archive: VehicleArchiveState,
    speeds_mps: Vec<f64>,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
    loops: Option<OnlineLoopsState<'a>>,
    revisions: Vec<Revision>,
}

impl SlidingEstimator {
    /// Has what only the end needs put away in files of a folder; before the first frame.
    pub(crate) fn put_rows_in(&mut self, folder: &Path) {
        self.ego = EgoArchive::named(folder.join("poses"));
        self.archive = VehicleArchive::named(folder.join("vehicles"));
        self.loops.iter_mut().for_each(|loops| loops.put_rows_in(folder));
    }

    /// The state after the last frame.
    ///
    /// # Errors
    /// Rows that could not be put away in a file with a name.
    pub(crate) fn state(&self) -> Result<SlidingState<'_>> {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            tracker,
            graph,
            estimated,
            placed,
            entries,
            remembered,
            fitters: _,
            keypoints,
            units,
            unit,
            ego,
            vehicles,
            archive,
            speeds_mps,
            stopwatch,
            warnings,
            loops,
            revisions,
        } = self;
        let unknown = || Error::Config("the graph of the last seconds holds a factor of another kind".into());
        let graph = graph.as_ref().map(|graph| graph.state().ok_or_else(unknown)).transpose()?;
        let loops = loops.as_ref().map(|loops| loops.state()).transpose();
        Ok(SlidingState {
            tracker: tracker.state(),
            graph,
            estimated: estimated.clone(),
            placed: placed.clone(),
            entries: entries.clone(),
            remembered: *remembered,
            keypoints: keypoints.clone(),
            units: units.state(),
            unit: *unit,
            ego: ego.state().map_err(|e| unusable(&e))?,
            vehicles: vehicles.clone(),
            archive: archive.state().map_err(|e| unusable(&e))?,
            speeds_mps: speeds_mps.clone(),
            stopwatch: stopwatch.clone(),
            warnings: warnings.clone(),
            loops: loops.map_err(|e| unusable(&e))?,
            revisions: revisions.clone(),
        })
    }

    /// As in a state, with the settings and the files of this one, which has taken no frame.
    ///
    /// # Errors
    /// A state of other settings, that does not fit together, or whose files are not as they were.
    pub(crate) fn resumed(&self, state: SlidingState<'_>, settings: &Settings) -> Result<Self> {
        let SlidingState {
            tracker,
            graph,
            estimated,
            placed,
            entries,
            remembered,
            keypoints,
            units,
            unit,
            ego,
            vehicles,
            archive,
            speeds_mps,
            stopwatch,
            warnings,
            loops,
            revisions,
        } = state;
        let new = Self::new(settings);
        let ego = self.ego.resumed(ego).map_err(|e| unusable(&e))?;
        let archive = self.archive.resumed(&archive).map_err(|e| unusable(&e))?;
        let rows = ego.len();
        let loops = match (&self.loops, loops) {
            (Some(own), Some(loops)) => Some(own.resumed(loops, rows).map_err(|e| unusable(&e))?),
            (None, None) => None,
            _ => return Err(Error::Input("the state is one of another configuration".to_owned())),
        };
        let graph = match graph {
            Some(graph) => {
                let (options, iterations) = (&settings.config.graph, settings.config.online.iterations);
                let own = MultibodyGraph::sliding(options, iterations);
                Some(own.and_then(|own| own.resumed(graph)).map_err(|e| unusable(&e))?)
            }
            None => None,
        };
        let ordered = estimated.is_sorted() && estimated.last().is_none_or(|last| *last < rows);
        if !ordered || placed.first > estimated.len() || speeds_mps.len() != rows {
            return Err(Error::Input("the estimates of the state do not fit together".to_owned()));
        }
        Ok(Self {
            tracker: new.tracker.resumed(tracker),
            graph,
            estimated,
            placed,
            entries,
            remembered,
            fitters: new.fitters,
            keypoints,
            units: new.units.resumed(units),
            unit,
            ego,
            vehicles,
            archive,
            speeds_mps,
            stopwatch,
            warnings,
            loops,
            revisions,
        })
    }
}

fn unusable(error: &dyn std::fmt::Display) -> Error {
    Error::Input(format!("the state of the run: {error}"))
}
