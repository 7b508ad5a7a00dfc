//! `speeds.csv`: speed of the camera, distance, closing speed and times to the vehicle ahead.

use std::io::{self, Write};
use std::path::Path;

use super::file;
use crate::config::Config;
use crate::error::Result;
use crate::result::RunResult;
use crate::speeds::{Estimated, speeds};

pub(super) fn write(folder: &Path, result: &RunResult, config: &Config) -> Result<()> {
    file(&folder.join("speeds.csv"), |out| table(out, result, config))
}

/// Cells stay empty where there is no vehicle ahead, or no such time.
fn table(out: impl Write, result: &RunResult, config: &Config) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    table.write_record([
        "frame",
        "time_s",
        "speed_mps",
        "sigma_speed_mps",
        "ahead_id",
        "ahead_class",
        "distance_m",
        "sigma_distance_m",
        "closing_speed_mps",
        "sigma_closing_speed_mps",
        "time_gap_s",
        "sigma_time_gap_s",
        "time_to_collision_s",
        "sigma_time_to_collision_s",
    ])?;
    for (frame, row) in result.frames.iter().zip(speeds(result, config)) {
        let ahead = row.ahead.as_ref();
        let mut cells = vec![frame.number.to_string(), format!("{:.6}", frame.timestamp_ns as f64 * 1e-9)];
        cells.extend(pair(Some(row.speed_mps)));
        cells.push(ahead.map_or_else(String::new, |a| a.id.to_string()));
        cells.push(ahead.map_or_else(String::new, |a| a.class.name().to_owned()));
        cells.extend(pair(ahead.map(|a| a.distance_m)));
        cells.extend(pair(ahead.map(|a| a.closing_mps)));
        cells.extend(pair(ahead.and_then(|a| a.time_gap_s)));
        cells.extend(pair(ahead.and_then(|a| a.time_to_collision_s)));
        table.write_record(cells)?;
    }
    table.flush()
}

fn pair(estimated: Option<Estimated>) -> [String; 2] {
    let number = |v: f64| if v.is_finite() { format!("{v:.3}") } else { String::new() };
    estimated.map_or_else(Default::default, |e| [number(e.value), number(e.sigma)])
}
