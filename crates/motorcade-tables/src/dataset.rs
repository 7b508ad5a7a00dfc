//! Many runs as one dataset: a file a drive in `frames/` and `tracks/`, and `drives.parquet` with a row a drive.

use std::fs;
use std::path::Path;

use motorcade::output::{OutputDirectory, io_error};
use motorcade::{RecordedRun, RunRecord};

use crate::drive::Drive;
use crate::drives::Drives;
use crate::error::{Error, Result};
use crate::run::RunFiles;
use crate::write::parquet_bytes;

/// Name of the record of a dataset, which lists its files.
pub const TABLES_RECORD: &str = "tables.json";

/// Writes the dataset of some runs. All of them are read before anything is written, and again one by one.
///
/// # Errors
/// A run that does not read, files that cannot be written; nothing is left behind then.
pub fn join(drives: &[Drive], directory: &OutputDirectory, command: &[String]) -> Result<()> {
    for drive in drives {
        RunRecord::read(&drive.run)?;
        RecordedRun::read(&drive.run)?;
        let files = RunFiles::read(&drive.run)?;
        files.frames(&drive.id).and(files.tracks(&drive.id))?;
    }
    let sources: Vec<_> = drives
        .iter()
        .map(|drive| serde_json::json!({"drive_id": drive.id, "run": drive.run.to_string_lossy()}))
        .collect();
    directory.write(
        |folder| write(drives, folder),
        |files, ()| {
            serde_json::json!({
                "motorcade": env!("CARGO_PKG_VERSION"),
                "command": command,
                "drives": sources,
                "files": files,
            })
        },
    )
}

fn write(drives: &[Drive], folder: &Path) -> Result<()> {
    let put = |name: String, bytes: Vec<u8>| {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|e| Error::from(io_error(&path, &e)))
    };
    for name in ["frames", "tracks"] {
        let path = folder.join(name);
        fs::create_dir(&path).map_err(|e| io_error(&path, &e))?;
    }
    let mut table = Drives::default();
    for drive in drives {
        let files = RunFiles::read(&drive.run)?;
        let (frames, tracks) = (files.frames(&drive.id)?, files.tracks(&drive.id)?);
        put(format!("frames/{}.parquet", drive.id), frames.bytes()?)?;
        put(format!("tracks/{}.parquet", drive.id), tracks.bytes()?)?;
        table.push(&drive.id, &RunRecord::read(&drive.run)?, &frames, &tracks);
    }
    put("drives.parquet".to_owned(), parquet_bytes(&table.table(), &[])?)
}

#[cfg(test)]
mod tests;
