//! Attempts at drives, read from all state files of a directory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::error::{Error, Result};
use crate::outcome::Outcome;
use crate::state::Line;

/// Attempts at a drive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Hash of the row that was tried last.
    pub row: String,
    /// Hash of its files then.
    pub files: String,
    /// Attempts at that row.
    pub attempts: u32,
    /// Outcome of the last finished attempt.
    pub outcome: Option<Outcome>,
}

/// Attempts at all drives, from the files of all shards: drives keep their state when the number of shards changes.
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

    /// Attempts at a drive.
    pub(crate) fn of(&self, id: &str) -> Option<&Known> {
        self.0.get(id)
    }
}

fn is_state(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with("state.") && name.ends_with(".jsonl")
}
