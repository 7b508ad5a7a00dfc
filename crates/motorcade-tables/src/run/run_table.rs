//! A table of a run, with a row group a minute.

use std::path::Path;

use super::catalogue::described;
use super::minutes::minutes;
use crate::error::{Error, Result};
use crate::table::{Column, Table, Values};
use crate::write::parquet_bytes;

/// A table of a run.
pub struct RunTable {
    /// The table.
    pub table: Table,
    /// Numbers of rows of each minute of the drive that has some.
    pub groups: Vec<usize>,
    /// Times of the rows \[ns\].
    pub times_ns: Vec<i64>,
}

/// Identity and start of a drive.
pub(super) struct Of<'a> {
    pub drive_id: &'a str,
    pub start_ns: i64,
    /// The file that most columns come from.
    pub path: &'a Path,
}

impl RunTable {
    /// Puts `drive_id` and `timestamp_ns` before the columns.
    pub(super) fn new(
        drive: &Of<'_>,
        (name, description): (&str, &str),
        columns: impl Iterator<Item = Column>,
        times_ns: Vec<i64>,
    ) -> Result<Self> {
        let id = Values::Text(vec![Some(drive.drive_id.to_owned()); times_ns.len()]);
        let times = Values::I64(times_ns.iter().copied().map(Some).collect());
        let front = [column("drive_id", id), column("timestamp_ns", times)];
        let columns = front.into_iter().chain(columns).collect();
        let table = Table { name: name.into(), description: description.into(), columns };
        table.validate().map_err(|e| Error::input(drive.path, e.to_string()))?;
        Ok(Self { table, groups: minutes(drive.start_ns, &times_ns), times_ns })
    }

    /// Content of its Parquet file.
    ///
    /// # Errors
    /// As [`parquet_bytes`].
    pub fn bytes(&self) -> Result<Vec<u8>> {
        parquet_bytes(&self.table, &self.groups)
    }
}

/// A column with what is known of its name.
pub(super) fn column(name: &str, values: Values) -> Column {
    let about = described(name);
    Column { name: name.into(), unit: about.unit.into(), description: about.description.into(), values }
}
