//! Text tables: rows of numbers whose errors name file and line. Other crates read their tables with it too.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::error::{Error, Result};
use crate::regular_file;

/// Largest number of a table. Squares and products of larger ones overflow, and no quantity in metres, pixels or seconds is.
pub const LARGEST: f64 = 1e12;

/// Latest time of a file \[s\], counted from 1970 in the year 2096: differences of times in nanoseconds fit into an i64.
const LATEST_S: i64 = 4_000_000_000;

/// Numbers separated by commas, as options have them; `None` where a part is no number.
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|part| part.trim().parse().ok()).collect()
}

/// A whole text file in memory.
pub struct TextFile {
    path: PathBuf,
    text: String,
}

/// One line of a [`TextFile`], split into fields.
pub struct Row<'a> {
    path: &'a Path,
    /// Line number, counted from 1.
    pub line: usize,
    /// The fields, trimmed.
    pub fields: Vec<&'a str>,
}

impl TextFile {
    /// Reads a UTF-8 file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_bytes(path, regular_file::read(path).map_err(Error::io(path))?)
    }
    /// The content that a file has or is to have; `path` names it in errors.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self> {
        let text =
            String::from_utf8(bytes).map_err(|_| Error::input(path, "is not a text file (not UTF-8)"))?;
        Ok(Self { path: path.to_path_buf(), text })
    }
    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
    /// The unparsed text.
    pub fn text(&self) -> &str {
        &self.text
    }
    /// Non-empty lines that do not start with `#`, split at white space.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.split(|line| line.split_whitespace().collect())
    }
    /// The same, split at commas.
    pub fn comma_rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.split(|line| line.split(',').map(str::trim).collect())
    }
    fn split<'a>(&'a self, fields: fn(&'a str) -> Vec<&'a str>) -> impl Iterator<Item = Row<'a>> {
        self.text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
            .map(move |(i, line)| Row { path: &self.path, line: i + 1, fields: fields(line) })
    }
}

impl Row<'_> {
    /// An error at this line.
    pub fn error(&self, expected: impl Into<String>, found: impl Display) -> Error {
        Error::Line {
            path: self.path.to_path_buf(),
            line: self.line,
            expected: expected.into(),
            found: found.to_string(),
        }
    }
    /// Checks the number of columns.
    pub fn require_columns(&self, allowed: &[usize], layout: &str) -> Result<()> {
        if allowed.contains(&self.fields.len()) {
            return Ok(());
        }
        let counts: Vec<String> = allowed.iter().map(ToString::to_string).collect();
        Err(self.error(
            format!("{} columns ({layout})", counts.join(" or ")),
            format!("{} columns", self.fields.len()),
        ))
    }
    /// Column `index` as a value; `what` names it in errors.
    pub fn parse<T: FromStr>(&self, index: usize, what: &str) -> Result<T> {
        let column = index + 1;
        let Some(field) = self.fields.get(index) else {
            return Err(self.error(format!("{what} in column {column}"), "the end of the line"));
        };
        field.parse().map_err(|_| self.error(format!("{what} in column {column}"), format!("`{field}`")))
    }
    /// Column `index` as a finite number of at most [`LARGEST`].
    pub fn number(&self, index: usize, what: &str) -> Result<f64> {
        let value: f64 = self.parse(index, what)?;
        if value.abs() <= LARGEST {
            return Ok(value);
        }
        let expected = format!("{what} in column {} to be finite and at most {LARGEST:e}", index + 1);
        Err(self.error(expected, format!("{value:e}")))
    }
    /// `N` numbers from column `first` on.
    pub fn numbers<const N: usize>(&self, first: usize, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            *value = self.number(first + i, what)?;
        }
        Ok(values)
    }
    /// Column `index` as a time in seconds, in \[ns\]. Parsed as integers, because a double cannot hold nanoseconds since 1970.
    pub fn nanoseconds(&self, index: usize) -> Result<i64> {
        let text = self.fields.get(index).copied().unwrap_or_default();
        let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
        let plain = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
        if plain(whole) && plain(fraction) && !whole.is_empty() {
            let nine = format!("{fraction:0<9}");
            let seconds = whole.parse::<i64>().ok().filter(|s| *s <= LATEST_S);
            if let Some((seconds, rest)) = seconds.zip(nine[..9].parse::<i64>().ok()) {
                return Ok(seconds * 1_000_000_000 + rest);
            }
        }
        let seconds = self.number(index, "a time in seconds")?;
        if seconds.abs() > LATEST_S as f64 {
            return Err(self.error(format!("a time of at most {LATEST_S} s"), text));
        }
        Ok((seconds * 1e9).round() as i64)
    }
}
