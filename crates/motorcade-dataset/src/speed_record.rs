//! Speeds over time: of a car's bus, a wheel sensor, a receiver's Doppler.

use std::path::Path;

use crate::distances::MeasuredDistance;
use crate::error::{Error, Result};
use crate::gps_track::{number, utc};
use crate::regular_file;

/// Standard deviation of a sample where the file does not give it \[m/s\]: buses round to 1 km/h.
const SIGMA_MPS: f64 = 0.3;
/// Speeds beyond are no road vehicle's \[m/s\].
const FASTEST_MPS: f64 = 200.0;
/// Time over which a distance is summed up, at least \[s\].
const SPAN_S: f64 = 1.0;
/// Longer gaps between samples are not bridged \[s\].
const LONGEST_GAP_S: f64 = 2.5;

/// A sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    time_s: f64,
    speed_mps: f64,
    sigma_mps: f64,
}

/// Speeds in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpeedRecord {
    samples: Vec<Sample>,
}

impl SpeedRecord {
    /// Reads a CSV file with a head: `time` in seconds or as RFC 3339; one of `speed_mps`, `speed_kmh`, `speed_mph`; optionally
    /// `sigma_mps`.
    ///
    /// # Errors
    /// A file that does not read, with its line; times that do not increase; speeds that no car has; fewer than two samples.
    pub fn read(path: &Path) -> Result<Self> {
        let text = regular_file::read_to_string(path).map_err(Error::io(path))?;
        let samples = samples(&text).map_err(|(line, problem)| Error::AtLine {
            path: path.to_path_buf(),
            line,
            problem,
        })?;
        if samples.len() < 2 {
            let problem = format!("{} speeds; expected two or more", samples.len());
            return Err(Error::input(path, problem));
        }
        Ok(Self { samples })
    }

    /// Distances of about a second each.
    pub fn distances(&self) -> Vec<MeasuredDistance> {
        let (mut out, mut begin) = (Vec::new(), 0);
        for (k, pair) in self.samples.windows(2).enumerate() {
            if pair[1].time_s - pair[0].time_s > LONGEST_GAP_S {
                begin = k + 1;
            } else if pair[1].time_s - self.samples[begin].time_s >= SPAN_S - 1e-9 {
                out.push(distance(&self.samples[begin..=k + 1]));
                begin = k + 1;
            }
        }
        out
    }
}

/// The distance by the trapezoidal rule; samples err independently.
fn distance(samples: &[Sample]) -> MeasuredDistance {
    let (mut metres, mut variance) = (0.0, 0.0);
    for (k, sample) in samples.iter().enumerate() {
        let time = |k: usize| samples[k.min(samples.len() - 1)].time_s;
        let share_s = 0.5 * (time(k + 1) - time(k.saturating_sub(1)));
        metres += share_s * sample.speed_mps;
        variance += (share_s * sample.sigma_mps).powi(2);
    }
    MeasuredDistance {
        from_s: samples[0].time_s,
        to_s: samples[samples.len() - 1].time_s,
        metres,
        sigma_m: variance.sqrt(),
        straight: false,
    }
}

fn samples(text: &str) -> std::result::Result<Vec<Sample>, (usize, String)> {
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let head = table.headers().map_err(|e| (1, e.to_string()))?.clone();
    let column = |name: &str| head.iter().position(|h| h.eq_ignore_ascii_case(name));
    let time = column("time").ok_or_else(|| (1, "expected a column time".to_owned()))?;
    let units = [("speed_mps", 1.0), ("speed_kmh", 1.0 / 3.6), ("speed_mph", 0.447_04)];
    let mut units = units.into_iter().filter_map(|(name, mps)| Some((column(name)?, name, mps)));
    let (speed, name, mps) =
        units.next().ok_or_else(|| (1, "expected a column speed_mps, speed_kmh or speed_mph".to_owned()))?;
    let sigma = column("sigma_mps");
    let mut out: Vec<Sample> = Vec::new();
    for (k, record) in table.records().enumerate() {
        let record = record.map_err(|e| (k + 2, e.to_string()))?;
        let wrong = |problem: String| (k + 2, problem);
        let cell = |column: usize| record.get(column).unwrap_or("");
        let sample = Sample {
            time_s: number(cell(time), "time").or_else(|_| utc(cell(time))).map_err(wrong)?,
            speed_mps: mps * number(cell(speed), name).map_err(wrong)?,
            sigma_mps: match sigma {
                Some(sigma) if !cell(sigma).is_empty() => number(cell(sigma), "sigma_mps").map_err(wrong)?,
                _ => SIGMA_MPS,
            },
        };
        if out.last().is_some_and(|before| sample.time_s <= before.time_s) {
            return Err(wrong("expected a time after that of the line before".to_owned()));
        }
        if !(sample.speed_mps.abs() <= FASTEST_MPS && sample.sigma_mps > 0.0 && sample.sigma_mps < 100.0) {
            return Err(wrong("speed or standard deviation out of range".to_owned()));
        }
        out.push(sample);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<SpeedRecord> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("speed.csv");
        std::fs::write(&path, text).unwrap();
        SpeedRecord::read(&path)
    }

    #[test]
    fn speeds_become_distances_of_a_second() {
        let rows: String = (0..=40).map(|k| format!("{},{}\n", 0.1 * f64::from(k), 36 + k)).collect();
        let found = read(&format!("time,speed_kmh\n{rows}")).unwrap().distances();
        assert_eq!(found.len(), 4);
        // 36 km/h and a rise of 10 km/h a second.
        for (k, one) in found.iter().enumerate() {
            assert!((one.metres - (41.0 + 10.0 * k as f64) / 3.6).abs() < 1e-9, "{one:?}");
            assert!((one.sigma_m - 0.3 * (0.1_f64 * 0.1 * 9.5).sqrt()).abs() < 1e-9 && !one.straight);
        }
        // A gap ends a distance.
        let found = read("time,speed_mps,sigma_mps\n0,10,1\n1,10,1\n9,10,1\n10,12,\n").unwrap().distances();
        let spans: Vec<(f64, f64)> = found.iter().map(|d| (d.from_s, d.to_s)).collect();
        assert_eq!(spans, [(0.0, 1.0), (9.0, 10.0)]);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, said) in [
            ("time,speed\n", "speed.csv:1: expected a column speed_mps, speed_kmh or speed_mph"),
            ("time,speed_mps\n0,1\n0,1\n", "speed.csv:3: expected a time after"),
            ("time,speed_mps\n0,1\n1,x\n", "speed.csv:3: speed_mps \"x\": expected a number"),
            ("time,speed_mps\n0,1\n1,1e9\n", "speed.csv:3: speed or standard deviation out of range"),
            ("time,speed_mps\n0,1\n", "1 speeds"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
        }
    }
}
