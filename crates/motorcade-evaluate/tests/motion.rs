//! Errors of a vehicle's depth and of its motion from frame to frame.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::path::Path;

use motorcade_dataset::{Label, write_kitti};
use motorcade_evaluate::evaluate_run;
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

#[test]
fn a_vehicle_that_drifts_and_turns_away() {
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
    let report = evaluate_run(&root.join("run"), root, "0001", 2, 0).unwrap();
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
}
