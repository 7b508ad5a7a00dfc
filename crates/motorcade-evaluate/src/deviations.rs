//! Standard deviations of vehicles, from `tracks.csv`.

use std::path::Path;

use motorcade_dataset::{Error as InputError, regular_file};

use crate::error::Result;

/// What a run states of a vehicle in a frame: standard deviations, and whether it moves.
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
    let problem = |e: csv::Error| InputError::Line {
        path: path.to_path_buf(),
        line: e.position().map_or(1, |p| usize::try_from(p.line()).unwrap_or(usize::MAX)),
        expected: "a row of tracks.csv".to_owned(),
        found: e.to_string(),
    };
    let mut reader = csv::Reader::from_reader(table);
    let known = reader.headers().map_err(problem)?;
    let needed = [
        "frame",
        "id",
        "sigma_relative_forward_m",
        "sigma_relative_left_m",
        "sigma_relative_up_m",
        "sigma_heading_rad",
        "p_moving",
    ];
    if !needed.iter().all(|name| known.iter().any(|column| column == *name)) {
        return Ok(None);
    }
    Ok(Some(reader.deserialize().collect::<std::result::Result<_, _>>().map_err(problem)?))
}
