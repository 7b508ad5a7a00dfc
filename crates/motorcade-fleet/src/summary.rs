//! The table of a batch: one line a drive.

use std::io;
use std::path::PathBuf;

use motorcade_dataset::atomic_file;

use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::options::Options;
use crate::state::Outcome;

const HEAD: [&str; 15] = [
    "id",
    "status",
    "exit_code",
    "attempts",
    "message",
    "warnings",
    "frames",
    "length_m",
    "duration_s",
    "vehicles",
    "wall_s",
    "cpu_s",
    "peak_rss_mb",
    "fingerprint",
    "output",
];

/// Writes the table.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(drives: &[(&Drive, Outcome)], options: &Options) -> Result<Vec<PathBuf>> {
    let path = options.summary_file("csv");
    let text = csv(drives, options).map_err(|e| Error::write(&path, e))?;
    atomic_file::write(&path, text).map_err(|e| Error::write(&path, e))?;
    Ok(vec![path])
}

fn csv(drives: &[(&Drive, Outcome)], options: &Options) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(HEAD)?;
    for (drive, outcome) in drives {
        writer.write_record(cells(drive, outcome, options))?;
    }
    writer.into_inner().map_err(|e| io::Error::other(e.to_string()))
}

fn cells(drive: &Drive, outcome: &Outcome, options: &Options) -> [String; 15] {
    let results = outcome.results.as_ref();
    let number = |value: Option<f64>, digits: usize| value.map_or(String::new(), |v| format!("{v:.digits$}"));
    let of = |get: fn(&crate::run_record::Results) -> String| results.map_or(String::new(), get);
    [
        drive.id.clone(),
        outcome.status.to_string(),
        outcome.exit_code.map_or(String::new(), |code| code.to_string()),
        outcome.attempts.to_string(),
        outcome.message.clone(),
        of(|r| r.warnings.join(" | ")),
        of(|r| r.frames.to_string()),
        number(results.and_then(|r| r.length_m), 3),
        number(results.and_then(|r| r.duration_s), 3),
        of(|r| r.vehicles.to_string()),
        number((outcome.attempts > 0).then_some(outcome.wall_s), 3),
        number(outcome.cpu_s, 2),
        number(outcome.peak_rss_mb, 1),
        of(|r| r.fingerprint.clone()),
        results.map_or(String::new(), |_| options.run_directory(&drive.id).display().to_string()),
    ]
}
