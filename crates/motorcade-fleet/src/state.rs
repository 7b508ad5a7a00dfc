//! The files `state*.jsonl`: a line for every attempt that begins and for every one that ends, on the disk before work goes on.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::outcome::Outcome;

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
