//! Metres by distances of another sensor: with an unknown, a right and a wrong height, and without a road.

#![allow(clippy::unwrap_used, reason = "a test")]

use crate::common::{HEIGHT_M, drive, settings};
use motorcade::{
    Config, DistanceSensor, Distances, External, FrontEndRecord, NoProgress, RunResult, Settings,
    estimate_drive,
};
use motorcade_dataset::{ClockOffset, MeasuredDistance};

const FRAMES: usize = 400;
/// One metre a frame.
const WAY_M: f64 = (FRAMES - 1) as f64;
const OFFSET_S: f64 = -0.7;
/// Error that all distances share.
const TOO_LONG: f64 = 1.01;

/// The time of a part of a frame \[s\]: a drive that is slower and faster in turns.
fn time_s(frame: f64) -> f64 {
    0.1 * frame + 0.8 * (frame / 30.0).sin()
}

/// A drive with these times.
fn uneven_drive() -> FrontEndRecord {
    let mut record = drive(FRAMES);
    for (k, (info, frame)) in record.frames.iter_mut().zip(&mut record.motion.frames).enumerate() {
        info.timestamp_ns = (1e9 * time_s(k as f64)) as i64;
        frame.timestamp_ns = info.timestamp_ns;
    }
    record
}

/// Distances of ten frames each, by a clock that is slow.
fn distances(sensor: DistanceSensor) -> Distances {
    let one = |k: usize| {
        let (from, to) = (10 * k + 3, 10 * k + 13);
        let straight = sensor == DistanceSensor::Gps;
        let line_m = (crate::common::pose(to).translation() - crate::common::pose(from).translation()).norm();
        let error_m = 0.05 * (k as f64 * 2.1).sin();
        MeasuredDistance {
            from_s: time_s(from as f64) + OFFSET_S,
            to_s: time_s(to as f64) + OFFSET_S,
            metres: TOO_LONG * if straight { line_m } else { 10.0 } + error_m,
            sigma_m: 0.05,
            straight,
        }
    };
    let clock = ClockOffset { offset_s: -0.2, sigma_s: 0.5 };
    Distances { sensor, measured: (0..FRAMES / 10 - 2).map(one).collect(), clock: Some(clock) }
}

fn run(record: FrontEndRecord, sensor: DistanceSensor, changed: impl Fn(&mut Settings)) -> RunResult {
    let external = External { distances: Some(distances(sensor)), ..External::default() };
    let mut settings = Settings { external, ..settings(Config::default()) };
    changed(&mut settings);
    estimate_drive(record, &settings, &NoProgress)
}

fn said<'a>(result: &'a RunResult, text: &str) -> Option<&'a String> {
    result.warnings.iter().find(|w| w.contains(text))
}

/// Relative standard deviation of the place furthest from the start.
fn sigma(result: &RunResult) -> f64 {
    let metres = |k: usize| result.ego.frames[k].world_from_camera.translation().norm();
    let far = (0..FRAMES).max_by(|a, b| metres(*a).total_cmp(&metres(*b))).unwrap();
    let axis = result.ego.frames[far].world_from_camera.translation().normalize();
    let rotation = result.ego.frames[far].world_from_camera.rotation();
    let covariance = result.ego.frames[far].covariance;
    let local = rotation.inverse() * axis;
    (covariance.fixed_view::<3, 3>(3, 3) * local).dot(&local).sqrt() / metres(far)
}

#[test]
fn an_unknown_height_is_estimated_by_speeds_and_fixes() {
    for (sensor, shared) in [(DistanceSensor::Speed, 0.02), (DistanceSensor::Gps, 0.005)] {
        let result = run(uneven_drive(), sensor, |s| (s.height_m, s.height_unknown) = (1.4, true));
        let off = (result.ego.length_m() / WAY_M).ln();
        assert!((off - TOO_LONG.ln()).abs() < 0.003, "{sensor}: {off}");
        assert!((result.ego.height_m / HEIGHT_M).ln().abs() < 0.02, "{} m", result.ego.height_m);
        assert!((shared * 0.9..shared * 1.6).contains(&sigma(&result)), "{sensor}: {}", sigma(&result));
        assert!(said(&result, "clock offset -0.70 s").is_some(), "{:?}", result.warnings);
    }
}

#[test]
fn height_and_speeds_share_by_their_variances() {
    let result = run(uneven_drive(), DistanceSensor::Speed, |_| ());
    // 0.6 % of the height, 2 % of speeds that are 1 % too high.
    let expected = TOO_LONG.ln() * 0.006_f64.powi(2) / (0.006_f64.powi(2) + 0.02_f64.powi(2));
    let off = (result.ego.length_m() / WAY_M).ln();
    assert!((off - expected).abs() < 0.001, "{off} {expected}");
    assert!(said(&result, "disagrees").is_none(), "{:?}", result.warnings);
}

#[test]
fn a_height_that_speeds_contradict_is_reported_and_doubted() {
    let result = run(uneven_drive(), DistanceSensor::Speed, |s| s.height_m = 0.85 * HEIGHT_M);
    let warning = said(&result, "disagrees with the speeds").unwrap();
    assert!(warning.contains(&format!("by which it is {:.2} ±", TOO_LONG * HEIGHT_M)), "{warning}");
    let off = (result.ego.length_m() / WAY_M).ln();
    assert!(off < -0.1 && off.abs() < 2.0 * sigma(&result), "{off} {}", sigma(&result));
}

#[test]
fn speeds_and_fixes_give_metres_without_a_road() {
    for sensor in [DistanceSensor::Speed, DistanceSensor::Gps] {
        let mut record = uneven_drive();
        record.road_measurements.clear();
        let result = run(record, sensor, |_| ());
        let off = (result.ego.length_m() / WAY_M).ln();
        assert!((off - TOO_LONG.ln()).abs() < 0.01, "{sensor}: {off}");
        assert!(off.abs() < 3.0 * sigma(&result), "{off} {}", sigma(&result));
        assert!(said(&result, "no road was seen: metres by").is_some(), "{:?}", result.warnings);
        assert!(said(&result, "never seen").is_none(), "{:?}", result.warnings);
    }
}

#[test]
fn distances_of_frames_that_were_bridged_are_not_used() {
    let mut record = uneven_drive();
    for frame in &mut record.motion.frames[5..] {
        frame.status = motorcade_odometry::FrameStatus::Bridged;
    }
    let result = run(record, DistanceSensor::Speed, |_| ());
    assert!(said(&result, "they were not used").is_some(), "{:?}", result.warnings);
}
