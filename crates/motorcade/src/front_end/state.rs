//! State of the front end between two frames, to be kept in a file.

use std::io;
use std::path::Path;

use motorcade_calibrate::FocalCheckState;
use motorcade_odometry::Rows;
use serde::{Deserialize, Serialize};

use super::{FrontEnd, PutAway};
use crate::archive::{Archive, ArchiveState, Stored, StoredList};
use crate::error::{Error, Result};
use crate::motion_source::MotionState;
use crate::place_recorder::PlaceRecorderState;
use crate::record::{FrameInfo, FrontEndRecord};
use crate::scale_source::ScaleState;
use crate::settings::Settings;
use crate::timing::Stopwatch;

/// State of the front end of a drive, without what its configuration gives.
#[derive(Serialize, Deserialize)]
pub(crate) struct FrontEndState {
    motion: MotionState,
    scale: ScaleState,
    places: Option<PlaceRecorderState>,
    focal: Option<FocalCheckState>,
    record: RecordState,
    away: PutAwayState,
    read_from: Option<usize>,
}

/// Record so far, as far as it is in memory.
#[derive(Serialize, Deserialize)]
struct RecordState {
    frames: Vec<FrameInfo>,
    /// First row in memory, and the rows from there on.
    detections: (usize, StoredList),
    keypoints: (usize, StoredList),
    forgotten_measurements: usize,
    forgotten: bool,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
}

/// The files of rows before those.
#[derive(Serialize, Deserialize)]
struct PutAwayState {
    motion: ArchiveState,
    measurements: ArchiveState,
    places: ArchiveState,
    detections: ArchiveState,
    keypoints: ArchiveState,
}

impl PutAway {
    /// Files in a folder.
    fn named(folder: &Path) -> Self {
        let file = |name: &str| folder.join(name);
        Self {
            motion: Archive::named(file("motion")),
            measurements: Archive::named(file("road")),
            places: Archive::named(file("places")),
            detections: Archive::named(file("detections")),
            keypoints: Archive::named(file("keypoints")),
        }
    }
}

impl FrontEnd {
    /// Has rows put away in files of a folder; before the first frame.
    pub(crate) fn put_rows_in(&mut self, folder: &Path) {
        self.away = PutAway::named(folder);
    }

    /// The state after the last frame.
    ///
    /// # Errors
    /// Rows that could not be put away in a file with a name.
    pub(crate) fn state(&self) -> Result<FrontEndState> {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self { motion, scale, places, focal, record, away, whole: _, read_from } = self;
        let PutAway { motion: motion_away, measurements, places: places_away, detections, keypoints } = away;
        let files = || {
            Ok(PutAwayState {
                motion: motion_away.state()?,
                measurements: measurements.state()?,
                places: places_away.state()?,
                detections: detections.state()?,
                keypoints: keypoints.state()?,
            })
        };
        Ok(FrontEndState {
            motion: motion.state(),
            scale: scale.state(),
            places: places.as_ref().map(|places| places.state()),
            focal: focal.as_ref().map(|focal| focal.state()),
            record: RecordState::of(record),
            away: files().map_err(|e: io::Error| unusable(&e))?,
            read_from: *read_from,
        })
    }

    /// As after the last frame of a state, with the configuration of this one.
    ///
    /// # Errors
    /// A state of another configuration, or whose files of rows are not as they were.
    pub(crate) fn resumed(&self, state: FrontEndState, settings: &Settings) -> Result<Self> {
        let FrontEndState { motion, scale, places, focal, record, away, read_from } = state;
        let other = || Error::Input("the state is one of another configuration".to_owned());
        let motion = self.motion.resumed(settings.camera, motion).ok_or_else(other)?;
        let frames = &motion.trajectory().frames;
        let read = |e: io::Error| unusable(&e);
        let (detections, keypoints) = (record.detections, record.keypoints);
        let rows = [frames.len(), detections.0 + detections.1.len(), keypoints.0 + keypoints.1.len()];
        // An online run forgets what its results do not list.
        let kept = |first: usize| if self.whole { first } else { 0 };
        let put_away = [
            (away.motion.len(), kept(frames.first_kept())),
            (away.detections.len(), detections.0),
            (away.keypoints.len(), kept(keypoints.0)),
        ];
        if rows != [record.frames.len(); 3] || put_away.iter().any(|(files, memory)| files != memory) {
            return Err(Error::Input("the rows of the state do not fit together".to_owned()));
        }
        let places = match (&self.places, &places) {
            (Some(own), Some(places)) => Some(own.resumed(places).map_err(read)?),
            (None, None) => None,
            _ => return Err(other()),
        };
        let focal = match (self.focal.clone(), focal) {
            (Some(mut own), Some(focal)) => {
                own.restore(focal);
                Some(own)
            }
            (None, None) => None,
            _ => return Err(other()),
        };
        let away = PutAway {
            motion: self.away.motion.resumed(&away.motion).map_err(read)?,
            measurements: self.away.measurements.resumed(&away.measurements).map_err(read)?,
            places: self.away.places.resumed(&away.places).map_err(read)?,
            detections: self.away.detections.resumed(&away.detections).map_err(read)?,
            keypoints: self.away.keypoints.resumed(&away.keypoints).map_err(read)?,
        };
        Ok(Self {
            motion,
            scale: self.scale.resumed(settings.camera, &settings.config, scale).ok_or_else(other)?,
            places,
            focal,
            record: FrontEndRecord {
                frames: record.frames,
                detections: rows_of(&detections)?,
                keypoints: rows_of(&keypoints)?,
                forgotten_measurements: record.forgotten_measurements,
                forgotten: record.forgotten,
                stopwatch: record.stopwatch,
                warnings: record.warnings,
                ..self.record.clone()
            },
            away,
            whole: self.whole,
            read_from,
        })
    }
}

impl RecordState {
    fn of(record: &FrontEndRecord) -> Self {
        // Fields left out are filled at the end of a drive alone, or say how a process ended.
        let FrontEndRecord {
            frames,
            detections,
            keypoints,
            detects_vehicles: _,
            motion: _,
            road_measurements: _,
            forgotten_measurements,
            forgotten,
            places: _,
            fixed_regions: _,
            focal_by_turns: _,
            stopwatch,
            warnings,
            interrupted: _,
            failed: _,
            planned_frames: _,
        } = record;
        Self {
            frames: frames.clone(),
            detections: (detections.first_kept(), StoredList::of(detections.kept())),
            keypoints: (keypoints.first_kept(), StoredList::of(keypoints.kept())),
            forgotten_measurements: *forgotten_measurements,
            forgotten: *forgotten,
            stopwatch: stopwatch.clone(),
            warnings: warnings.clone(),
        }
    }
}

fn rows_of<T: Stored>((first, list): &(usize, StoredList)) -> Result<Rows<T>> {
    Ok(Rows::starting_at(*first, list.items().map_err(|e| unusable(&e))?))
}

fn unusable(error: &io::Error) -> Error {
    Error::Input(format!("the state of the run: {error}"))
}
