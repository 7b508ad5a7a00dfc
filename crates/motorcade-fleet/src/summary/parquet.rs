//! The table as a Parquet file.

use std::io;

use motorcade_tables as tables;

use super::table::{Table, Values};

/// The bytes of the file.
pub(super) fn bytes(table: &Table) -> io::Result<Vec<u8>> {
    let columns = table.iter().map(|column| tables::Column {
        name: column.name.to_owned(),
        unit: column.unit.to_owned(),
        description: column.description.to_owned(),
        values: match &column.values {
            Values::F64(v) => tables::Values::F64(v.clone()),
            Values::I64(v) => tables::Values::I64(v.clone()),
            Values::U64(v) => tables::Values::U64(v.clone()),
            Values::Text(v) => tables::Values::Text(v.clone()),
        },
    });
    let table = tables::Table {
        name: "drives".to_owned(),
        description: "One row a drive of a batch".to_owned(),
        columns: columns.collect(),
    };
    tables::parquet_bytes(&table, &[]).map_err(io::Error::other)
}
