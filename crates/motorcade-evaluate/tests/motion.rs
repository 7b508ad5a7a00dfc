//! Errors of a vehicle's depth and motion, its deviations, and P(moving).

#![allow(clippy::unwrap_used, reason = "a test")]

use std::path::Path;

use motorcade_dataset::{Label, write_kitti};
use motorcade_evaluate::{Report, evaluate_run};
use motorcade_geometry::{BoundingBox, Camera, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

const FRAMES: u64 = 20;

/// A car that drives away at 1 m a frame; `drift` more, and it turns by a degree a frame more.
fn car(frame: u64, drift_m: f64) -> Label {
    let s = frame as f64;
    let depth = 10.0 + s * (1.0 + drift_m);
    let turn = if drift_m == 0.0 { 0.0 } else { s.to_radians() };
    Label {
        frame,
        track: 1,
        class: "Car".into(),
        truncated: 0.0,
        occluded: 0.0,
        alpha_rad: 0.0,
        bbox: BoundingBox::new([600.0, 100.0, 680.0, 160.0]),
        size_hwl_m: [1.5, 1.6, 3.9],
        location_m: [0.0, 1.65, depth],
        ry_rad: -std::f64::consts::FRAC_PI_2 + turn,
        score: None,
    }
}

fn write(path: &Path, drift_m: f64) {
    let lines: String = (0..FRAMES).map(|frame| car(frame, drift_m).to_line() + "\n").collect();
    std::fs::write(path, lines).unwrap();
}

/// The run and its ground truth; `tracks_csv` is the run's table of vehicles.
fn report(tracks_csv: Option<&str>) -> motorcade_evaluate::Result<Report> {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for name in ["calib", "gt_poses", "run", "label_02"] {
        std::fs::create_dir_all(root.join(name)).unwrap();
    }
    let calib = "P0: 700 0 600 0 0 700 170 0 0 0 1 0\nP2: 700 0 600 0 0 700 170 0 0 0 1 0\n";
    std::fs::write(root.join("calib/0001.txt"), calib).unwrap();
    let camera = |s: u64| -> Pose<World, Camera> {
        Pose::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, 0.8 * s as f64))
    };
    let poses: Vec<_> = (0..FRAMES).map(camera).collect();
    for file in ["gt_poses/0001.txt", "run/ego.kitti.txt"] {
        write_kitti(std::fs::File::create(root.join(file)).unwrap(), &poses).unwrap();
    }
    write(&root.join("label_02/0001.txt"), 0.0);
    write(&root.join("run/tracks.kitti.txt"), 0.1);
    if let Some(table) = tracks_csv {
        std::fs::write(root.join("run/tracks.csv"), table).unwrap();
    }
    evaluate_run(&root.join("run"), root, "0001", 2, 0)
}

/// A table in which the car's depth has a deviation of 0.5 m and its heading one of 10°.
fn table(p_moving: f64) -> String {
    let head = "frame,id,p_moving,sigma_heading_rad,sigma_relative_forward_m,sigma_relative_left_m,sigma_relative_up_m\n";
    let row = |frame: u64| format!("{frame},1,{p_moving},{},0.5,0.5,0.1\n", 10f64.to_radians());
    head.to_owned() + &(0..FRAMES).map(row).collect::<String>()
}

#[test]
fn a_vehicle_that_drifts_and_turns_away() {
    let report = report(None).unwrap();
    assert!(report.vehicles_consistency.is_none() && report.moving.is_none());
    let (vehicle, mean) = (&report.vehicles.unwrap()[0], report.vehicles_mean.unwrap());
    let (found_m, found_deg) = (vehicle.motion_error_m.unwrap(), vehicle.motion_error_deg.unwrap());
    assert!((found_deg - 1.0).abs() < 1e-3, "{found_deg}");
    assert!(found_m > 0.1 && found_m < 0.6, "{found_m}");
    // 0.1 s of 10 + s metres: 19 values from 0 to 6.6 %, and the median between.
    let expected = |s: f64| 100.0 * 0.1 * s / (10.0 + s);
    let median = mean.depth_error_pct_median.unwrap();
    assert!((median - 0.5 * (expected(9.0) + expected(10.0))).abs() < 1e-3, "{median}");
    assert!(mean.depth_error_pct_p90.unwrap() > median);
    assert_eq!(mean.motion_error_m, vehicle.motion_error_m);
    // Each metre 0.1 m too much, as in the frame before, and a degree.
    let (over_m, over_deg) = (vehicle.rpe_m_per_m.unwrap(), vehicle.rpe_deg_per_m.unwrap());
    assert!((over_deg - found_deg / 1.8).abs() < 0.02, "{over_deg}");
    assert!((over_m - found_m / 1.8).abs() < 0.02, "{over_m} {found_m}");
}

#[test]
fn errors_are_compared_with_the_deviations_of_the_table() {
    let report = report(Some(&table(0.8))).unwrap();
    let consistency = report.vehicles_consistency.unwrap();
    // Of errors of 0 to 1.9 m the first 11 are below 1 m, of turns of 0 to 19° none reaches 20.
    assert_eq!(consistency.depth.frames, FRAMES as usize);
    assert!((consistency.depth.within_two_sigma - 11.0 / 20.0).abs() < 1e-9, "{consistency:?}");
    assert!((consistency.depth.largest_sigma - 3.8).abs() < 0.02);
    assert_eq!(consistency.heading.within_two_sigma, 1.0);
    assert!((consistency.heading.largest_sigma - 1.9).abs() < 1e-3);
    let moving = report.moving.unwrap();
    assert_eq!((moving.vehicles, moving.rows.len()), (1, 1));
    assert!((moving.brier - 0.04).abs() < 1e-9 && moving.rows[0].moves == 1.0);
    assert_eq!(moving.rows[0].range, [0.7, 0.95]);
}

#[test]
fn tables_without_deviations_are_passed_over_and_broken_ones_named() {
    let without = report(Some("frame,id,p_moving\n0,1,0.5\n")).unwrap();
    assert!(without.vehicles_consistency.is_none() && without.moving.is_none());
    let broken = report(Some(&table(0.8).replacen("0,1,0.8,", "0,1,much,", 1))).unwrap_err().to_string();
    assert!(broken.contains("tracks.csv:2") && broken.contains("p_moving"), "{broken}");
}
