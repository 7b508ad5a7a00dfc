//! `frames.csv`, `ego.tum` and `tracks.csv` of a run, and the tables they make.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade::RunResult;
use motorcade::output::{frames_csv, tracks_csv};
use motorcade_dataset::text::TextFile;
use motorcade_dataset::write_tum;

use super::cells::columns;
use super::run_table::{Of, RunTable, column};
use crate::error::{Error, Result};
use crate::table::{Column, Values};

/// Columns of the camera's pose, as `ego.tum` has them after the time.
const POSE: [&str; 7] = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"];
/// Names and descriptions of the tables.
const FRAMES: (&str, &str) = ("frames", "One row a frame of the drive; pose of the camera in the world");
const TRACKS: (&str, &str) = ("tracks", "One row a vehicle and frame; pose of the vehicle in the world");

/// The files of a run that its tables are made of.
pub struct RunFiles {
    frames: TextFile,
    poses: TextFile,
    tracks: TextFile,
}

/// `frames.csv` of a run's directory as a table, with `drive_id`, `timestamp_ns` and the camera's pose.
///
/// # Errors
/// A file that is missing or does not read, `ego.tum` of another length.
pub fn frames(run: &Path, drive_id: &str) -> Result<RunTable> {
    RunFiles::read(run)?.frames(drive_id)
}

/// `tracks.csv` of a run's directory as a table, with `drive_id` and `timestamp_ns`.
///
/// # Errors
/// A file that is missing or does not read, a vehicle in a frame that the run does not have.
pub fn tracks(run: &Path, drive_id: &str) -> Result<RunTable> {
    RunFiles::read(run)?.tracks(drive_id)
}

impl RunFiles {
    /// Those of a run's directory.
    ///
    /// # Errors
    /// A file that is missing or no text.
    pub fn read(run: &Path) -> Result<Self> {
        let file = |name: &str| TextFile::read(&run.join(name));
        Ok(Self { frames: file("frames.csv")?, poses: file("ego.tum")?, tracks: file("tracks.csv")? })
    }

    /// Those that a result will have in the directory `run`: the same bytes.
    ///
    /// # Errors
    /// None: text that was just written reads.
    pub fn of(result: &RunResult, run: &Path) -> Result<Self> {
        let mut poses = Vec::new();
        let rows = result.frames.iter().zip(&result.ego.frames);
        // Writing to memory does not fail.
        let _ = write_tum(&mut poses, rows.map(|(f, ego)| (f.timestamp_ns, ego.world_from_camera)));
        let file = |name: &str, bytes| TextFile::from_bytes(&run.join(name), bytes);
        Ok(Self {
            frames: file("frames.csv", frames_csv(result))?,
            poses: file("ego.tum", poses)?,
            tracks: file("tracks.csv", tracks_csv(result))?,
        })
    }

    /// The table of frames.
    ///
    /// # Errors
    /// As [`frames()`].
    pub fn frames(&self, drive_id: &str) -> Result<RunTable> {
        let (times_ns, poses) = self.poses()?;
        let own = columns(&self.frames)?;
        let (rows, found) = (own.first().map_or(0, |column| column.values.len()), times_ns.len());
        if rows != found {
            let problem = format!("has {found} poses, expected {rows}, one a row of frames.csv");
            return Err(Error::input(self.poses.path(), problem));
        }
        let drive = Self::drive(drive_id, &times_ns, &self.frames);
        RunTable::new(&drive, FRAMES, own.into_iter().chain(poses), times_ns)
    }

    /// The table of vehicles.
    ///
    /// # Errors
    /// As [`tracks()`].
    pub fn tracks(&self, drive_id: &str) -> Result<RunTable> {
        let frames = numbers(&columns(&self.frames)?, &self.frames)?;
        let poses_ns = self.poses()?.0;
        let times: BTreeMap<u64, i64> = frames.into_iter().zip(poses_ns.iter().copied()).collect();
        let own = columns(&self.tracks)?;
        let time = |number: u64| {
            times.get(&number).copied().ok_or_else(|| {
                let problem = format!("has a vehicle in frame {number}, expected frames of frames.csv");
                Error::input(self.tracks.path(), problem)
            })
        };
        let times_ns = numbers(&own, &self.tracks)?.into_iter().map(time).collect::<Result<_>>()?;
        let drive = Self::drive(drive_id, &poses_ns, &self.tracks);
        RunTable::new(&drive, TRACKS, own.into_iter(), times_ns)
    }

    fn drive<'a>(drive_id: &'a str, poses_ns: &[i64], file: &'a TextFile) -> Of<'a> {
        Of { drive_id, start_ns: poses_ns.first().copied().unwrap_or_default(), path: file.path() }
    }

    /// Times and columns of the poses.
    fn poses(&self) -> Result<(Vec<i64>, Vec<Column>)> {
        let mut times_ns = Vec::new();
        let mut values: [Vec<Option<f64>>; 7] = Default::default();
        for row in self.poses.rows() {
            row.require_columns(&[8], "t x y z qx qy qz qw")?;
            times_ns.push(row.nanoseconds(0)?);
            let pose: [f64; 7] = row.numbers(1, "a number of the pose")?;
            values.iter_mut().zip(pose).for_each(|(column, value)| column.push(Some(value)));
        }
        let columns = POSE.iter().zip(values).map(|(name, values)| column(name, Values::F64(values)));
        Ok((times_ns, columns.collect()))
    }
}

/// Frame numbers of a table.
fn numbers(columns: &[Column], file: &TextFile) -> Result<Vec<u64>> {
    let wrong =
        || Error::input(file.path(), "expected a table with a number in every row of `frame`".to_owned());
    match columns.iter().find(|column| column.name == "frame").map(|column| &column.values) {
        Some(Values::U64(values)) => values.iter().map(|v| v.ok_or_else(wrong)).collect(),
        _ => Err(wrong()),
    }
}
