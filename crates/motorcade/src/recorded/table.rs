//! Tables whose columns have names.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_dataset::text::{Row, TextFile};
use motorcade_dataset::{Error, Result};

/// A CSV file with a head.
pub(super) struct Table {
    file: TextFile,
    columns: BTreeMap<String, usize>,
}

/// A row of it.
pub(super) struct NamedRow<'a> {
    row: Row<'a>,
    columns: &'a BTreeMap<String, usize>,
}

impl Table {
    pub(super) fn read(path: &Path) -> Result<Self> {
        let file = TextFile::read(path)?;
        let head: Vec<String> = file
            .comma_rows()
            .next()
            .map(|row| row.fields.iter().map(ToString::to_string).collect())
            .unwrap_or_default();
        if head.is_empty() {
            let problem = "is empty; expected the head of a table".to_owned();
            return Err(Error::Input { path: path.to_path_buf(), problem });
        }
        let columns = head.into_iter().enumerate().map(|(k, name)| (name, k)).collect();
        Ok(Self { file, columns })
    }

    /// Rows after the head.
    pub(super) fn rows(&self) -> impl Iterator<Item = NamedRow<'_>> {
        self.file.comma_rows().skip(1).map(|row| NamedRow { row, columns: &self.columns })
    }
}

impl NamedRow<'_> {
    /// A finite number.
    pub(super) fn number(&self, name: &str) -> Result<f64> {
        self.row.number(self.column(name)?, name)
    }
    /// A finite number; `None` for an empty cell.
    pub(super) fn number_or_none(&self, name: &str) -> Result<Option<f64>> {
        let column = self.column(name)?;
        let is_empty = self.row.fields.get(column).is_some_and(|cell| cell.is_empty());
        if is_empty { Ok(None) } else { self.row.number(column, name).map(Some) }
    }
    /// `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, names: [&str; N]) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            *value = self.number(name)?;
        }
        Ok(values)
    }
    /// A whole number.
    pub(super) fn whole(&self, name: &str) -> Result<u64> {
        self.row.parse(self.column(name)?, name)
    }
    pub(super) fn text(&self, name: &str) -> Result<String> {
        self.row.parse(self.column(name)?, name)
    }
    /// Numbers from a column on, by place.
    pub(super) fn numbers_from<const N: usize>(&self, first: usize, what: &str) -> Result<[f64; N]> {
        self.row.numbers(first, what)
    }
    /// An error at this row.
    pub(super) fn error(&self, expected: &str, found: impl std::fmt::Display) -> Error {
        self.row.error(expected, found)
    }
    fn column(&self, name: &str) -> Result<usize> {
        let found = self.columns.get(name).copied();
        found.ok_or_else(|| self.row.error(format!("a table with a column `{name}`"), "none"))
    }
}
