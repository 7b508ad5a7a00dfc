//! The table of a batch: one line a drive.

mod table;

use std::io;
use std::path::PathBuf;

use motorcade_dataset::atomic_file;
use motorcade_tables::{Table, Values, parquet_bytes};

use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::options::Options;
use crate::outcome::Outcome;

/// Writes the table as Parquet and as CSV.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(drives: &[(&Drive, Outcome)], options: &Options) -> Result<Vec<PathBuf>> {
    let table = table::table(drives, options);
    let put = |extension: &str, bytes: io::Result<Vec<u8>>| {
        let path = options.summary_file(extension);
        let written = bytes.and_then(|bytes| atomic_file::write(&path, bytes));
        written.map(|()| path.clone()).map_err(|e| Error::write(&path, e))
    };
    Ok(vec![put("parquet", parquet_bytes(&table, &[]).map_err(io::Error::other))?, put("csv", csv(&table))?])
}

fn csv(table: &Table) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(table.columns.iter().map(|column| &column.name))?;
    for row in 0..table.rows() {
        writer.write_record(table.columns.iter().map(|column| cell(&column.values, row)))?;
    }
    writer.into_inner().map_err(|e| io::Error::other(e.to_string()))
}

/// Milliseconds and millimetres are enough for people; the Parquet file has all digits.
fn cell(values: &Values, row: usize) -> String {
    let text = match values {
        Values::F64(v) => v.get(row).copied().flatten().map(|value| format!("{value:.3}")),
        Values::I64(v) | Values::TimestampNs(v) => {
            v.get(row).copied().flatten().map(|value| value.to_string())
        }
        Values::U64(v) => v.get(row).copied().flatten().map(|value| value.to_string()),
        Values::Bool(v) => v.get(row).copied().flatten().map(|value| value.to_string()),
        Values::Text(v) => v.get(row).cloned().flatten(),
    };
    text.unwrap_or_default()
}
