//! Tables written as Parquet.

use std::io::Write;
use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray, TimestampNanosecondArray,
    UInt64Array,
};
use arrow_schema::{DataType, Field, Schema, TimeUnit};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};

use crate::error::{Error, Result};
use crate::metadata::key_values;
use crate::table::{Column, Table, Values};

/// Writes a table. `groups` are the numbers of rows of the row groups; rows after the last one make another, and without any the
/// whole table is one.
///
/// # Errors
/// Columns of different lengths or of one name, groups of more rows than there are, a file that cannot be written.
pub fn write_parquet(out: impl Write + Send, table: &Table, groups: &[usize]) -> Result<()> {
    table.validate()?;
    let failed = |source| Error::Write { table: table.name.clone(), source };
    let batch = batch(table).map_err(failed)?;
    let properties = properties(table).map_err(failed)?;
    let mut writer = ArrowWriter::try_new(out, batch.schema(), Some(properties)).map_err(failed)?;
    let mut first = 0;
    for rows in groups.iter().copied().filter(|rows| *rows > 0) {
        if rows > batch.num_rows() - first {
            let problem = format!("row groups of more than its {} rows", batch.num_rows());
            return Err(Error::Table { table: table.name.clone(), problem });
        }
        writer.write(&batch.slice(first, rows)).and_then(|()| writer.flush()).map_err(failed)?;
        first += rows;
    }
    if first < batch.num_rows() {
        writer.write(&batch.slice(first, batch.num_rows() - first)).map_err(failed)?;
    }
    writer.close().map(drop).map_err(failed)
}

/// The same in memory.
///
/// # Errors
/// As [`write_parquet`].
pub fn parquet_bytes(table: &Table, groups: &[usize]) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    write_parquet(&mut out, table, groups)?;
    Ok(out)
}

fn batch(table: &Table) -> Result<RecordBatch, ParquetError> {
    let fields: Vec<Field> = table.columns.iter().map(field).collect();
    let arrays = table.columns.iter().map(|column| array(&column.values)).collect();
    Ok(RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)?)
}

fn field(column: &Column) -> Field {
    let kind = match &column.values {
        Values::F64(_) => DataType::Float64,
        Values::I64(_) => DataType::Int64,
        Values::U64(_) => DataType::UInt64,
        Values::Text(_) => DataType::Utf8,
        Values::Bool(_) => DataType::Boolean,
        Values::TimestampNs(_) => DataType::Timestamp(TimeUnit::Nanosecond, None),
    };
    let about = [("unit", &column.unit), ("description", &column.description)];
    let about = about.into_iter().filter(|(_, text)| !text.is_empty());
    // All may be null: tables of several runs have one schema.
    Field::new(&column.name, kind, true)
        .with_metadata(about.map(|(key, text)| (key.to_owned(), text.clone())).collect())
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::F64(v) => Arc::new(Float64Array::from(v.clone())),
        Values::I64(v) => Arc::new(Int64Array::from(v.clone())),
        Values::U64(v) => Arc::new(UInt64Array::from(v.clone())),
        Values::Text(v) => Arc::new(StringArray::from_iter(v)),
        Values::Bool(v) => Arc::new(BooleanArray::from(v.clone())),
        Values::TimestampNs(v) => Arc::new(TimestampNanosecondArray::from(v.clone())),
    }
}

fn properties(table: &Table) -> Result<WriterProperties, ParquetError> {
    Ok(WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_created_by(format!("motorcade {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(key_values(table)))
        .set_max_row_group_row_count(None)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .build())
}

#[cfg(test)]
mod tests;
