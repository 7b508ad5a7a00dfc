//! Standard deviations of vehicles, from `tracks.csv`.

use std::path::Path;

use motorcade_dataset::{Error as InputError, regular_file};

use crate::error::Result;

/// Columns without which the table tells nothing.
const NEEDED: [&str; 7] = [
    "frame",
    "id",
    "sigma_relative_forward_m",
    "sigma_relative_left_m",
    "sigma_relative_up_m",
    "sigma_heading_rad",
    "p_moving",
];

/// Statements of a run on a vehicle in a frame: standard deviations, and whether it moves.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
pub struct VehicleDeviations {
    /// The input's own frame number.
    pub frame: u64,
    /// Identity.
    pub id: i64,
    /// Of the position relative to the camera, along the vehicle's x axis (forward) \[m\].
    #[serde(rename = "sigma_relative_forward_m")]
    pub forward_m: f64,
    /// The same along y (left) \[m\].
    #[serde(rename = "sigma_relative_left_m")]
    pub left_m: f64,
    /// The same along z (up) \[m\].
    #[serde(rename = "sigma_relative_up_m")]
    pub up_m: f64,
    /// Of the heading \[rad\].
    #[serde(rename = "sigma_heading_rad")]
    pub heading_rad: f64,
    /// Probability that the vehicle moves.
    pub p_moving: f64,
}

/// Reads a run's `tracks.csv`, columns by name; `None` for tables without these columns, as other programs and early versions write.
///
/// # Errors
/// A file that does not read, and a cell that is no number; file and line are named.
pub(crate) fn read_deviations(path: &Path) -> Result<Option<Vec<VehicleDeviations>>> {
    let text = regular_file::read_to_string(path)
        .map_err(|source| InputError::Io { path: path.to_path_buf(), source })?;
    parse_deviations(path, text.as_bytes())
}

/// As [`read_deviations`], of a table in memory; `path` is what errors name.
pub(crate) fn parse_deviations(path: &Path, table: &[u8]) -> Result<Option<Vec<VehicleDeviations>>> {
    let mut reader = csv::Reader::from_reader(table);
    let head = reader.headers().map_err(|e| problem(path, &e, "the names of columns".into()))?.clone();
    if !NEEDED.iter().all(|name| head.iter().any(|column| column == *name)) {
        return Ok(None);
    }
    let rows: std::result::Result<Vec<VehicleDeviations>, csv::Error> = reader.deserialize().collect();
    Ok(Some(rows.map_err(|e| {
        let column = match e.kind() {
            csv::ErrorKind::Deserialize { err, .. } => {
                err.field().and_then(|k| head.get(usize::try_from(k).ok()?))
            }
            _ => None,
        };
        problem(
            path,
            &e,
            column.map_or_else(|| "a row of tracks.csv".into(), |name| format!("a number as {name}")),
        )
    })?))
}

fn problem(path: &Path, error: &csv::Error, expected: String) -> InputError {
    let line = error.position().map_or(1, |p| usize::try_from(p.line()).unwrap_or(usize::MAX));
    InputError::Line { path: path.to_path_buf(), line, expected, found: error.to_string() }
}
