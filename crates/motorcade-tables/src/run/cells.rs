//! Cells of a CSV file as typed columns.

use std::str::FromStr;

use motorcade_dataset::text::{Row, TextFile};
use motorcade_dataset::{Error, Result};

use super::catalogue::{Kind, described};
use super::run_table::column;
use crate::table::{Column, Values};

/// Columns of a file with a head, in its order; empty cells are null.
pub(super) fn columns(file: &TextFile) -> Result<Vec<Column>> {
    let mut rows = file.comma_rows();
    let head = rows.next().ok_or_else(|| Error::Input {
        path: file.path().to_path_buf(),
        problem: "is empty; expected the head of a table".to_owned(),
    })?;
    let mut columns: Vec<Column> = head.fields.iter().map(|name| empty(name)).collect();
    for row in rows {
        row.require_columns(&[columns.len()], "as the head of the table")?;
        for (k, column) in columns.iter_mut().enumerate() {
            push(column, &row, k)?;
        }
    }
    Ok(columns)
}

fn empty(name: &str) -> Column {
    let values = match described(name).kind {
        Kind::Number => Values::F64(Vec::new()),
        Kind::Whole => Values::U64(Vec::new()),
        Kind::Text => Values::Text(Vec::new()),
        Kind::Flag => Values::Bool(Vec::new()),
    };
    column(name, values)
}

fn push(column: &mut Column, row: &Row<'_>, k: usize) -> Result<()> {
    let name = &column.name;
    let filled = !row.fields[k].is_empty();
    match &mut column.values {
        Values::F64(v) => v.push(filled.then(|| row.number(k, name)).transpose()?),
        Values::U64(v) => v.push(filled.then(|| parse(row, k, name)).transpose()?),
        Values::I64(v) | Values::TimestampNs(v) => v.push(filled.then(|| parse(row, k, name)).transpose()?),
        Values::Text(v) => v.push(filled.then(|| row.fields[k].to_owned())),
        Values::Bool(v) => v.push(filled.then(|| parse(row, k, name)).transpose()?),
    }
    Ok(())
}

fn parse<T: FromStr>(row: &Row<'_>, k: usize, name: &str) -> Result<T> {
    row.parse(k, name)
}
