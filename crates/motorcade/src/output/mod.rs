//! The directory of a run: written beside its place and renamed when complete.

mod camera;
mod detections;
mod graph;
mod record;
mod tracks;

pub(crate) use camera::status_name;
pub use tracks::track_labels;

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

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
    /// Hash of all that decides the results; a finished run with the same one need not be repeated.
    pub fingerprint: String,
}

/// A file of a run, or more of them: name relative to the directory and content.
pub struct Extra {
    /// Path relative to the run's directory.
    pub name: String,
    /// Content.
    pub content: Vec<u8>,
}

/// Checks that results can go to `directory`: absent or empty, or `force`; its parent writable.
///
/// # Errors
/// A directory that holds something, a file of that name, a parent that cannot be written.
pub fn prepare(directory: &Path, force: bool) -> Result<()> {
    if directory.is_file() {
        return Err(output_error(directory, "a file has this name"));
    }
    let occupied = fs::read_dir(directory).is_ok_and(|mut entries| entries.next().is_some());
    if occupied && !force {
        return Err(Error::Config(format!(
            "{} is not empty; choose another --out or add --force to replace it",
            directory.display()
        )));
    }
    if occupied && !directory.join("run.json").exists() {
        let text = "--force replaces runs only, and this directory holds no run.json; choose another --out";
        return Err(Error::Config(format!("{}: {text}", directory.display())));
    }
    let parent = parent_of(directory);
    fs::create_dir_all(&parent).map_err(|e| io_error(&parent, &e))?;
    // The surest test of a writable place is to write.
    tempfile::tempdir_in(&parent).map(drop).map_err(|e| io_error(&parent, &e))
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
/// A file that cannot be written; nothing is left behind then, and an earlier run in `directory` stays.
pub fn write_run(directory: &Path, result: &RunResult, context: &RunContext, extras: &[Extra]) -> Result<()> {
    let parent = parent_of(directory);
    fs::create_dir_all(&parent).map_err(|e| io_error(&parent, &e))?;
    let staging = tempfile::Builder::new()
        .prefix(".motorcade-")
        .tempdir_in(&parent)
        .map_err(|e| io_error(&parent, &e))?;
    let folder = staging.path();
    camera::write(folder, result)?;
    tracks::write(folder, result, context)?;
    detections::write(folder, result)?;
    graph::write(folder, result)?;
    record::write(folder, result, context)?;
    for extra in extras {
        file(&folder.join(&extra.name), |out| out.write_all(&extra.content))?;
    }
    let staged = staging.keep();
    replace(&staged, directory).map_err(|e| {
        // Best effort: the error that matters is the one returned.
        let _ = fs::remove_dir_all(&staged);
        io_error(directory, &e)
    })
}

fn replace(staged: &Path, directory: &Path) -> io::Result<()> {
    // tempfile makes private folders; results are for everybody.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(staged, fs::Permissions::from_mode(0o755))?;
    }
    let old = directory.with_extension("motorcade-old");
    let had = directory.exists();
    if had {
        fs::rename(directory, &old)?;
    }
    if let Err(e) = fs::rename(staged, directory) {
        if had {
            fs::rename(&old, directory)?;
        }
        return Err(e);
    }
    if had { fs::remove_dir_all(&old) } else { Ok(()) }
}

fn parent_of(directory: &Path) -> PathBuf {
    match directory.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
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

pub(crate) fn io_error(path: &Path, error: &io::Error) -> Error {
    let full = matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded);
    // tempfile puts the name of its own file into the message; ours is the one that matters.
    let reason = match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code).to_string(),
        None => error.kind().to_string(),
    };
    Error::Output { path: path.to_path_buf(), reason, full }
}

fn output_error(path: &Path, reason: &str) -> Error {
    Error::Output { path: path.to_path_buf(), reason: reason.to_owned(), full: false }
}
