//! Values of a YAML calibration by their keys.

use std::path::Path;

use super::yaml::{Entry, entries};
use crate::error::{Error, Result};

/// The entries of a file.
pub(super) struct Document<'a> {
    pub path: &'a Path,
    pub entries: Vec<Entry>,
}

impl<'a> Document<'a> {
    pub(super) fn new(path: &'a Path, text: &str) -> Self {
        Self { path, entries: entries(text) }
    }

    pub(super) fn get(&self, names: &[&str]) -> Option<&Entry> {
        // A key whose children hold the numbers has no value of its own.
        self.entries.iter().find(|entry| !entry.value.is_empty() && names.contains(&entry.key.as_str()))
    }

    pub(super) fn wrong(&self, entry: &Entry, expected: impl Into<String>) -> Error {
        Error::Line {
            path: self.path.to_path_buf(),
            line: entry.line,
            expected: expected.into(),
            found: format!("`{}`", entry.value),
        }
    }

    pub(super) fn number(&self, names: &[&str]) -> Result<Option<f64>> {
        let Some(entry) = self.get(names) else { return Ok(None) };
        entry.value.parse().map(Some).map_err(|_| self.wrong(entry, format!("a number for {}", entry.key)))
    }

    pub(super) fn list(&self, names: &[&str]) -> Result<Option<Vec<f64>>> {
        let Some(entry) = self.get(names) else { return Ok(None) };
        let items = entry.value.split([',', ' ', '[', ']']).filter(|item| !item.is_empty());
        let parsed: Result<Vec<f64>, _> = items.map(str::parse).collect();
        parsed.map(Some).map_err(|_| self.wrong(entry, format!("a list of numbers for {}", entry.key)))
    }

    /// A list of N numbers, when it is there.
    pub(super) fn numbers<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(list) = self.list(&[name])? else { return Ok(None) };
        let found = list.len();
        let exact = list.try_into();
        exact
            .map(Some)
            .map_err(|_| Error::input(self.path, format!("{name} has {found} numbers, expected {N}")))
    }
}
