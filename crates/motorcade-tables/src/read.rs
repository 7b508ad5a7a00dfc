//! Small Parquet files read as text.

use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::path::Path;

use motorcade_dataset::regular_file;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use parquet::schema::types::SchemaDescriptor;

use crate::error::{Error, Result};

/// Most rows of a file that is read as text.
const MOST_ROWS: i64 = 1_000_000;

/// Rows of a flat Parquet file, each with the text of its cells by the names of the columns. Nulls are empty; numbers have the
/// fewest digits that give them back; times in nanoseconds are whole numbers, other times and dates text as `2024-05-01 …`.
/// For lists that a person or a script wrote, at most a million rows.
///
/// # Errors
/// A file that is missing, damaged or no Parquet, columns that are lists or structures, a compression other than zstd and Snappy.
pub fn read_rows(path: &Path) -> Result<Vec<BTreeMap<String, String>>> {
    // The decoder panics on lengths that are negative, among other things that only a damaged file has.
    catch_unwind(|| rows_of(path)).unwrap_or_else(|_| {
        Err(Error::parquet(path, "its decoding failed by a fault of the program; the file may be damaged"))
    })
}

fn rows_of(path: &Path) -> Result<Vec<BTreeMap<String, String>>> {
    let file = regular_file::open(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
    let unreadable = |e: ParquetError| {
        let advice = "expected a Parquet file, uncompressed or compressed with zstd or Snappy";
        Error::parquet(path, format!("{e}; {advice}"))
    };
    let reader = SerializedFileReader::new(file).map_err(unreadable)?;
    let metadata = reader.metadata().file_metadata();
    if metadata.num_rows() > MOST_ROWS {
        let rows = metadata.num_rows();
        return Err(Error::parquet(path, format!("has {rows} rows, expected at most {MOST_ROWS}")));
    }
    flat(metadata.schema_descr()).map_err(|problem| Error::parquet(path, problem))?;
    let rows = reader.get_row_iter(None).map_err(unreadable)?;
    let text = |row: Result<Row, ParquetError>| cells(row.map_err(unreadable)?, path);
    rows.map(text).collect()
}

/// Refuses columns of more than one value a row.
fn flat(schema: &SchemaDescriptor) -> Result<(), String> {
    for column in schema.root_schema().get_fields() {
        let repeated = column.get_basic_info().has_repetition()
            && column.get_basic_info().repetition() == parquet::basic::Repetition::REPEATED;
        if column.is_group() || repeated {
            let name = column.name();
            return Err(format!("column `{name}` holds lists or structures; expected plain values"));
        }
    }
    Ok(())
}

fn cells(row: Row, path: &Path) -> Result<BTreeMap<String, String>> {
    let cell = |(name, field): (String, Field)| {
        let text = match field {
            Field::Null => String::new(),
            Field::Str(text) => text,
            Field::Bytes(bytes) => String::from_utf8(bytes.data().to_vec())
                .map_err(|_| Error::parquet(path, format!("column `{name}` holds bytes that are no text")))?,
            other => other.to_string(),
        };
        Ok((name, text))
    };
    row.into_columns().into_iter().map(cell).collect()
}

#[cfg(test)]
mod tests;
