//! The list of drives: CSV, one JSON object a line, or Parquet.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_dataset::regular_file;

use crate::column::{COLUMNS, Column};
use crate::drive::Drive;
use crate::error::{Error, Result};
use crate::jsonl;
use crate::row::Row;

/// Drives in the order of the file.
#[derive(Clone, Debug)]
pub struct Manifest {
    /// The drives.
    pub drives: Vec<Drive>,
}

impl Manifest {
    /// Reads a manifest. `defaults` are columns and values for the rows that have none; settings of both are taken.
    ///
    /// # Errors
    /// A file that does not read; the first row that cannot be run, with line and column.
    pub fn read(path: &Path, defaults: &[(&str, String)]) -> Result<Self> {
        let rows = rows(path)?;
        let base = path.parent().unwrap_or(Path::new(""));
        let defaults: Vec<_> = defaults
            .iter()
            .filter_map(|(name, value)| Column::find(name).map(|column| (column, value.clone())))
            .collect();
        let mut lines = BTreeMap::new();
        let mut drives = Vec::with_capacity(rows.len());
        for row in &rows {
            let own = |problem: String| Error::manifest(path, row.line, problem);
            let drive = Drive::new(row, base, &defaults).map_err(own)?;
            // Some file systems take `A` and `a` for the same name.
            if let Some(line) = lines.insert(drive.id.to_ascii_lowercase(), row.line) {
                let problem = format!(
                    "column `id`: `{}` is the id of line {line} too; give each drive its own `id`",
                    drive.id
                );
                return Err(own(problem));
            }
            drives.push(drive);
        }
        Ok(Self { drives })
    }
}

fn rows(path: &Path) -> Result<Vec<Row>> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "csv" => csv_rows(path),
        "jsonl" | "ndjson" => {
            jsonl::rows(&text(path)?).map_err(|(line, problem)| Error::manifest(path, line, problem))
        }
        "parquet" => {
            let rows = motorcade_tables::read_rows(path)?;
            Ok((1..).zip(rows).map(|(number, cells)| Row::new(number, cells)).collect())
        }
        _ => Err(Error::manifest(path, 1, "expected a name that ends in .csv, .jsonl or .parquet")),
    }
}

fn text(path: &Path) -> Result<String> {
    let text = regular_file::read_to_string(path).map_err(|e| Error::read(path, e))?;
    // Spreadsheets begin their files with it.
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

fn csv_rows(path: &Path) -> Result<Vec<Row>> {
    let text = text(path)?;
    let wrong = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Error::manifest(path, line, e.to_string())
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let names = reader.headers().map_err(wrong)?.clone();
    check_header(path, &names)?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(1, csv::Position::line);
        let cells = names.iter().zip(&record).map(|(name, value)| (name.to_owned(), value.to_owned()));
        rows.push(Row::new(line, cells));
    }
    Ok(rows)
}

/// Columns that no row fills are errors too, and so are two of one name.
fn check_header(path: &Path, names: &csv::StringRecord) -> Result<()> {
    for (k, name) in names.iter().enumerate() {
        if !COLUMNS.contains(&name.replace('-', "_").as_str()) {
            let known = COLUMNS.join(", ");
            return Err(Error::manifest(path, 1, format!("column `{name}` is not known; columns: {known}")));
        }
        if names.iter().take(k).any(|other| other.replace('-', "_") == name.replace('-', "_")) {
            return Err(Error::manifest(path, 1, format!("column `{name}` is there twice")));
        }
    }
    Ok(())
}
