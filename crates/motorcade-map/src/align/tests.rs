//! Tracks made of a known run.

use motorcade::{RecordedFrame, RecordedRun};
use motorcade_dataset::TrackPoint;
use motorcade_geometry::Pose;
use nalgebra::{Matrix6, UnitQuaternion, Vector3};

use super::*;

/// A bend of 90 degrees at a speed that changes: 60 s at 10 frames a second.
fn run() -> RecordedRun {
    let (mut heading, mut at) = (0.0_f64, Vector3::zeros());
    let frames = (0..600).map(|k| {
        let time = f64::from(k) * 0.1;
        let speed = 10.0 + 4.0 * (time / 9.0).sin();
        heading += if (200..300).contains(&k) { 0.0157 } else { 0.0 };
        at += Vector3::new(heading.sin(), 0.0, heading.cos()) * speed * 0.1;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), heading);
        RecordedFrame {
            number: k as u64,
            timestamp_ns: i64::from(k) * 100_000_000,
            status: "tracked".into(),
            speed_mps: speed,
            speed_sigma_mps: Some(0.1),
            road_normal: -Vector3::y(),
            world_from_camera: Pose::from_parts(turn, at),
            covariance: Matrix6::identity() * 1e-4,
        }
    });
    RecordedRun { frames: frames.collect(), vehicles: Vec::new() }
}

/// Errors that look random and are the same each time.
fn noise(k: usize) -> f64 {
    ((k as f64 * 12.9898).sin() * 43_758.545).fract() * 2.0
}

const START: Geodetic = Geodetic { latitude_deg: 49.011, longitude_deg: 8.423, altitude_m: 112.0 };
const OFFSET_S: f64 = 1_714_557_600.4;

/// A fix a second of a run that starts northwest, five of them 60 m away.
fn track(run: &RecordedRun, sigma_m: f64) -> GpsTrack {
    let anchor = Anchor { start: START, heading_deg: 315.0, sigma: None, clock_offset_s: None };
    let placed = crate::Placed::new(run, anchor).unwrap();
    let points = run.frames.iter().skip(5).step_by(10).enumerate().map(|(k, frame)| {
        let outlier = if k % 12 == 7 { 60.0 } else { 0.0 };
        let error = Vector3::new(noise(k) * sigma_m + outlier, noise(k + 500) * sigma_m, 0.0);
        let at = placed.place(&frame.world_from_camera.translation()).moved(&error);
        TrackPoint { time_s: frame.timestamp_ns as f64 * 1e-9 + OFFSET_S, at, sigma_m: 2.0 }
    });
    GpsTrack { points: points.collect() }
}

fn about(wrong_s: f64, sigma_s: f64) -> ClockOffset {
    ClockOffset { offset_s: OFFSET_S + wrong_s, sigma_s }
}

#[test]
fn heading_place_and_clock_are_found_among_outliers() {
    let run = run();
    let found = align(&run, &track(&run, 1.0), None, &AlignOptions::default()).unwrap();
    let (position_sigma, heading_sigma) = found.anchor.sigma.unwrap();
    let first =
        crate::Placed::new(&run, found.anchor).unwrap().place(&run.frames[0].world_from_camera.translation());
    let apart = START.local(&first).xy().norm();
    assert!(apart < 2.0 * position_sigma && position_sigma < 4.0, "{apart} of {position_sigma}");
    let turned = (found.anchor.heading_deg - 315.0).abs();
    assert!(turned < 2.0 * heading_sigma && heading_sigma < 2.0, "{turned} of {heading_sigma}");
    let late = (found.anchor.clock_offset_s.unwrap() - OFFSET_S).abs();
    assert!(late < 2.0 * found.clock_sigma_s && late < 0.5, "{late} of {}", found.clock_sigma_s);
    assert_eq!(found.fixes, (60, 5));
}

#[test]
fn without_noise_it_is_exact() {
    let run = run();
    let mut exact = track(&run, 0.0);
    exact.points =
        exact.points.into_iter().enumerate().filter(|(k, _)| k % 12 != 7).map(|(_, p)| p).collect();
    let found = align(&run, &exact, Some(about(-1.0, 2.0)), &AlignOptions::default()).unwrap();
    assert!(found.rms_m < 0.05, "{}", found.rms_m);
    assert!((found.anchor.heading_deg - 315.0).abs() < 0.05, "{}", found.anchor.heading_deg);
}

#[test]
fn what_does_not_fit_is_refused() {
    let run = run();
    let track = track(&run, 1.0);
    let message = |run: &RecordedRun, track: &GpsTrack, known| {
        align(run, track, known, &AlignOptions::default()).unwrap_err().to_string()
    };
    assert!(
        message(&run, &track, Some(ClockOffset { offset_s: 0.0, sigma_s: 1.0 })).contains("clock offset")
    );
    let standing = {
        let mut run = run.clone();
        let first = run.frames[0].world_from_camera;
        run.frames.iter_mut().for_each(|f| f.world_from_camera = first);
        run
    };
    assert!(message(&standing, &track, None).contains("do not determine the heading"));
}

/// On a bend of constant curvature at constant speed an error of the clock looks like another start and heading.
#[test]
fn what_the_fixes_cannot_tell_apart_is_wide() {
    let mut circle = run();
    circle.frames.truncate(100);
    for (k, frame) in circle.frames.iter_mut().enumerate() {
        let turn = 0.02 * k as f64;
        let at = Vector3::new(1.0 - turn.cos(), 0.0, turn.sin()) * 50.0;
        frame.world_from_camera =
            Pose::from_parts(UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn), at);
    }
    let message = align(&circle, &track(&circle, 1.0), Some(about(1.0, 3.0)), &AlignOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("give the clock offset"), "{message}");
    // 10 m/s and 11.5 degrees a second.
    let found =
        align(&circle, &track(&circle, 1.0), Some(about(0.3, 0.3)), &AlignOptions::default()).unwrap();
    let (position_sigma, heading_sigma) = found.anchor.sigma.unwrap();
    assert!((0.2..0.4).contains(&found.clock_sigma_s), "{}", found.clock_sigma_s);
    assert!(position_sigma > 2.5 && heading_sigma > 2.5, "{position_sigma} {heading_sigma}");
}

/// A short drive that hardly bends: several clock offsets fit, and fewer fixes fit better than all.
#[test]
fn what_several_offsets_explain_is_wide_or_refused() {
    let mut short = run();
    short.frames.truncate(120);
    let mut answers = 0;
    for seed in 0..12 {
        let noisy = |longer: bool| {
            let mut track = track(&short, 0.0);
            if longer {
                let whole = self::track(&run(), 0.0);
                track.points = whole.points.into_iter().take(30).collect();
            }
            for (k, point) in track.points.iter_mut().enumerate() {
                let error = Vector3::new(noise(k + 31 * seed), noise(k + 31 * seed + 700), 0.0);
                point.at = point.at.moved(&(1.5 * error));
            }
            track
        };
        for longer in [false, true] {
            let Ok(found) = align(&short, &noisy(longer), None, &AlignOptions::default()) else { continue };
            answers += usize::from(!longer);
            let late = (found.anchor.clock_offset_s.unwrap() - OFFSET_S).abs();
            assert!(late < 2.5 * found.clock_sigma_s, "{seed} {longer}: {late} of {}", found.clock_sigma_s);
            let (_, heading_sigma) = found.anchor.sigma.unwrap();
            let turned = (found.anchor.heading_deg - 315.0).abs();
            assert!(turned < 2.5 * heading_sigma, "{seed} {longer}: {turned} of {heading_sigma}");
        }
    }
    // A track of the drive alone is placed.
    assert!(answers > 6, "{answers}");
}
