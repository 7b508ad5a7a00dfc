//! An hour of driving at geometry level: what follows the frames must fit into a gigabyte.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test")]

use crate::common::{drive, settings};
use motorcade::{Config, NoProgress, estimate_drive};

/// Frames of an hour at 10 Hz.
const HOUR: usize = 36_000;

/// Most memory this process ever held \[MB\].
#[cfg(target_os = "linux")]
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

#[test]
#[ignore = "a minute of computing; .ci/run runs it"]
#[cfg(target_os = "linux")]
fn an_hour_fits_into_a_gigabyte() {
    let start = std::time::Instant::now();
    let result = estimate_drive(drive(HOUR), &settings(Config::default()), &NoProgress);
    let (seconds, peak) = (start.elapsed().as_secs_f64(), peak_mb());
    println!("{HOUR} frames: {seconds:.1} s, peak {peak:.0} MB, {} vehicles", result.vehicles.len());
    assert_eq!(result.ego.frames.len(), HOUR);
    assert!(result.graph.is_some(), "{:?}", result.warnings);
    assert!(result.vehicles.len() > 200);
    assert!((result.ego.length_m() / HOUR as f64 - 1.0).abs() < 0.02, "{}", result.ego.length_m());
    assert!(peak < 1000.0, "{peak} MB");
}
