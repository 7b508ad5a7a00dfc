//! The files of a run.

mod camera;
mod detections;
mod directory;
mod graph;
mod listing;
mod loops;
mod record;
mod speeds;
mod track_table;
mod tracks;

pub use camera::status_name;
pub use directory::{OutputDirectory, RUN_RECORD};
pub use listing::{CHECKPOINT, CHECKPOINT_STATE, GROWING_TRACKS, ListedFile};
pub(crate) use track_table::TrackRow;
pub use track_table::TrackTable;
pub use tracks::track_labels;

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use motorcade_dataset::Cam0;
use motorcade_geometry::{Camera, Pose};

use crate::config::Config;
use crate::error::{Error, Result};
use crate::result::RunResult;

/// Facts about a run that stand in its outputs beside the result.
#[derive(Clone, Debug)]
pub struct RunContext {
    /// Configuration of the run.
    pub config: Config,
    /// `camera_from_cam0` of KITTI input: results in KITTI format are in cam0, as its labels; identity otherwise.
    pub camera_from_cam0: Pose<Camera, Cam0>,
    /// Description of the input.
    pub input: motorcade_dataset::Summary,
    /// Sources of vehicles and road in words.
    pub perception: (String, String),
    /// The command that was run.
    pub command: Vec<String>,
    /// Hash of all that decides the results; a finished run with the same one need not be repeated. `None` for runs that are not recognised
    /// by one: the demo, frames in memory.
    pub fingerprint: Option<String>,
}

/// A file of a run, or more of them: name relative to the directory and content.
pub struct Extra {
    /// Path relative to the run's directory.
    pub name: String,
    /// Content.
    pub content: Vec<u8>,
}

/// `frames.csv` of a result: one row a frame, as [`write_run`] writes it.
pub fn frames_csv(result: &RunResult) -> Vec<u8> {
    in_memory(|out| camera::frames(out, result))
}

/// `tracks.csv` of a result: one row a vehicle and frame, as [`write_run`] writes it.
pub fn tracks_csv(result: &RunResult) -> Vec<u8> {
    in_memory(|out| tracks::table(out, result))
}

fn in_memory(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Vec<u8> {
    let mut out = Vec::new();
    // Writing to memory does not fail.
    let _ = write(&mut out);
    out
}

/// Makes a folder for single files, where it is not there yet.
///
/// # Errors
/// A file of that name, a place that cannot be written.
pub fn prepare_folder(directory: &Path) -> Result<()> {
    if directory.is_file() {
        return Err(output_error(directory, "a file has this name"));
    }
    fs::create_dir_all(directory).map_err(|e| io_error(directory, &e))?;
    tempfile::tempdir_in(directory).map(drop).map_err(|e| io_error(directory, &e))
}

/// Writes all files of a run into `directory`, completely or not at all; `extras` come along.
///
/// # Errors
/// A file that cannot be written; nothing is left behind then, and an earlier run in `directory` stays. When the last move
/// fails, the error names the directory that holds the results.
pub fn write_run(
    directory: &OutputDirectory,
    result: &RunResult,
    context: &RunContext,
    extras: &[Extra],
) -> Result<()> {
    write_run_and(directory, result, context, extras, |_| ())
}

/// The same; `more` adds files to the folder that holds all others but the record by then. What it adds is listed in the record.
///
/// # Errors
/// As [`write_run`].
pub fn write_run_and(
    directory: &OutputDirectory,
    result: &RunResult,
    context: &RunContext,
    extras: &[Extra],
    more: impl FnOnce(&Path),
) -> Result<()> {
    let fill = |folder: &Path| -> Result<()> {
        camera::write(folder, result)?;
        tracks::write(folder, result, context)?;
        speeds::write(folder, result, &context.config)?;
        detections::write(folder, result)?;
        graph::write(folder, result)?;
        loops::write(folder, result)?;
        for extra in extras {
            file(&folder.join(&extra.name), |out| out.write_all(&extra.content))?;
        }
        Ok(())
    };
    let fill = |folder: &Path| -> Result<()> {
        fill(folder).map_err(|error| directory.in_place(error, folder))?;
        more(folder);
        Ok(())
    };
    directory.write(fill, |files, ()| record::record(result, context, files))
}

/// Writes one file through a buffer.
pub(crate) fn file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<fs::File>) -> io::Result<()>,
) -> Result<()> {
    let go = || -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut out = BufWriter::new(fs::File::create(path)?);
        write(&mut out)?;
        out.flush()
    };
    go().map_err(|e| io_error(path, &e))
}

/// An error of the file system at a place of results.
pub fn io_error(path: &Path, error: &io::Error) -> Error {
    let full = matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded);
    // tempfile puts the name of its own file into the message; ours is the one that matters.
    let inner = error.get_ref().and_then(|e| e.source()).and_then(|e| e.downcast_ref::<io::Error>());
    Error::Output { path: path.to_path_buf(), reason: inner.unwrap_or(error).to_string(), full }
}

fn output_error(path: &Path, reason: &str) -> Error {
    Error::Output { path: path.to_path_buf(), reason: reason.to_owned(), full: false }
}
