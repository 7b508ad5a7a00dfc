//! A table of named columns.

use crate::error::{Error, Result};

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Name, such as `frames`.
    pub name: String,
    /// What a row is.
    pub description: String,
    /// The columns, all of one length.
    pub columns: Vec<Column>,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, with the unit as suffix: `speed_mps`.
    pub name: String,
    /// Unit, such as `m/s`; empty where there is none.
    pub unit: String,
    /// What the values are, in which frame.
    pub description: String,
    /// The values.
    pub values: Values,
}

/// Values of a column; `None` is null.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    F64(Vec<Option<f64>>),
    /// Whole numbers.
    I64(Vec<Option<i64>>),
    /// Whole numbers from 0.
    U64(Vec<Option<u64>>),
    /// Text.
    Text(Vec<Option<String>>),
    /// True or false.
    Bool(Vec<Option<bool>>),
    /// Times in nanoseconds since 1970, without a time zone.
    TimestampNs(Vec<Option<i64>>),
}

impl Values {
    /// Number of values, nulls among them.
    pub fn len(&self) -> usize {
        match self {
            Self::F64(v) => v.len(),
            Self::I64(v) | Self::TimestampNs(v) => v.len(),
            Self::U64(v) => v.len(),
            Self::Text(v) => v.len(),
            Self::Bool(v) => v.len(),
        }
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Checks that it has columns, all of one length, each name once.
    ///
    /// # Errors
    /// The first column that does not fit.
    pub fn validate(&self) -> Result<()> {
        let wrong = |problem: String| Err(Error::Table { table: self.name.clone(), problem });
        if self.columns.is_empty() {
            return wrong("has no columns".into());
        }
        for (k, column) in self.columns.iter().enumerate() {
            let (name, found, rows) = (&column.name, column.values.len(), self.rows());
            if self.columns[..k].iter().any(|before| before.name == *name) {
                return wrong(format!("has two columns `{name}`"));
            }
            if found != rows {
                return wrong(format!("column `{name}` has {found} values, expected {rows}"));
            }
        }
        Ok(())
    }
}
