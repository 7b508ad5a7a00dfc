//! The files `state*.jsonl`: a line for every attempt that begins and for every one that ends, on the disk before work goes on.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::run_record::Results;
use crate::status::Status;

/// How a drive's last attempt ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How the drive stands.
    pub status: Status,
    /// Exit code of the process; none when a signal ended it.
    pub exit_code: Option<i32>,
    /// Attempts at this row, those of earlier batches included.
    pub attempts: u32,
    /// Why there are no results.
    pub message: String,
    /// Time of the last attempt \[s\].
    pub wall_s: f64,
    /// Processor time of the process and those it waited for \[s\], where the system tells.
    pub cpu_s: Option<f64>,
    /// Most resident memory of the process and those it started \[MB\], where the system tells.
    pub peak_rss_mb: Option<f64>,
    /// The results.
    pub results: Option<Results>,
}

impl Outcome {
    pub(crate) fn pending(attempts: u32) -> Self {
        Self {
            status: Status::Pending,
            exit_code: None,
            attempts,
            message: String::new(),
            wall_s: 0.0,
            cpu_s: None,
            peak_rss_mb: None,
            results: None,
        }
    }
}

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Line {
    /// Milliseconds since 1970.
    pub time_ms: u64,
    /// The drive.
    pub id: String,
    /// Hash of what the row says.
    pub row: String,
    /// Hash of sizes and times of its files.
    pub files: String,
    /// None for an attempt that begins.
    pub outcome: Option<Outcome>,
}

impl Line {
    pub(crate) fn now(id: &str, row: &str, files: &str, outcome: Option<Outcome>) -> Self {
        let time_ms = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |t| t.as_millis() as u64);
        Self { time_ms, id: id.to_owned(), row: row.to_owned(), files: files.to_owned(), outcome }
    }
}

/// The file of one batch, open for more lines.
pub(crate) struct State {
    path: PathBuf,
    file: File,
}

impl State {
    /// Opens the file; a line that a killed batch left unfinished is ended.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let open = || -> io::Result<File> {
            let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
            let mut last = [b'\n'];
            if file.seek(SeekFrom::End(0))? > 0 {
                file.seek(SeekFrom::End(-1))?;
                file.read_exact(&mut last)?;
            }
            if last != *b"\n" {
                file.write_all(b"\n")?;
            }
            Ok(file)
        };
        Ok(Self { path: path.to_path_buf(), file: open().map_err(|e| Error::write(path, e))? })
    }

    /// Adds a line and waits until it is on the disk.
    pub(crate) fn append(&mut self, line: &Line) -> Result<()> {
        let mut text = serde_json::to_string(line).unwrap_or_default();
        text.push('\n');
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| Error::write(&self.path, e))
    }
}

/// What is known about a drive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Hash of the row that was tried last.
    pub row: String,
    /// Hash of its files then.
    pub files: String,
    /// Attempts at that row.
    pub attempts: u32,
    /// End of the last attempt that ended.
    pub outcome: Option<Outcome>,
}

/// Everything that all files of a directory tell: drives keep their state when the number of shards changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct History(BTreeMap<String, Known>);

impl History {
    /// Reads all files of the directory. Lines that do not read were cut off by a crash and are left out.
    pub(crate) fn read(out: &Path) -> Result<Self> {
        let mut lines = Vec::new();
        let entries = fs::read_dir(out).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let mut paths: Vec<PathBuf> =
            entries.map_err(|e| Error::read(out, e))?.into_iter().map(|entry| entry.path()).collect();
        paths.sort();
        for path in paths.iter().filter(|path| is_state(path)) {
            let bytes = fs::read(path).map_err(|e| Error::read(path, e))?;
            let whole = bytes
                .split(|byte| *byte == b'\n')
                .filter_map(|line| serde_json::from_slice::<Line>(line).ok());
            lines.extend(whole);
        }
        lines.sort_by_key(|line| line.time_ms);
        let mut history = Self::default();
        lines.into_iter().for_each(|line| history.add(line));
        Ok(history)
    }

    fn add(&mut self, line: Line) {
        let known = self.0.entry(line.id).or_default();
        if known.row != line.row {
            *known = Known { row: line.row, ..Known::default() };
        }
        known.files = line.files;
        match line.outcome {
            None => known.attempts += 1,
            outcome => known.outcome = outcome,
        }
    }

    /// What is known about a drive.
    pub(crate) fn of(&self, id: &str) -> Option<&Known> {
        self.0.get(id)
    }
}

fn is_state(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with("state.") && name.ends_with(".jsonl")
}
