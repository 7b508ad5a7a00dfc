//! The independent judge (`tools/judge.py` of `MOTORCADE_SHARED`) and we give the same numbers.
//!
//! The drive is made here from sines, so that the judge's numbers can also stand in this file: they are compared
//! always, the judge itself runs where Python with numpy and the script are there.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

use std::f64::consts::TAU;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use motorcade_dataset::{Label, write_kitti, write_tum};
use motorcade_evaluate::{Report, evaluate_run};
use motorcade_geometry::{BoundingBox, Camera, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;

const FIRST: u64 = 5;
const FRAMES: u64 = 60;

/// World = cam0 of frame 0; the estimate drifts in scale and heading.
fn camera(frame: u64, drift: f64) -> Pose<World, Camera> {
    let s = frame as f64;
    let heading = 0.012 * s + 0.0005 * drift * s;
    let along = 1.1 * s * (1.0 + 0.02 * drift);
    let position = Vector3::new(0.008 * s * s + 0.05 * drift * (0.9 * s).sin(), -0.01 * s, along);
    Pose::from_parts(UnitQuaternion::from_euler_angles(0.002 * (0.3 * s).sin(), heading, 0.0), position)
}

/// Vehicle `track` as labelled in cam0 (`noise` 0) or as estimated.
fn vehicle(frame: u64, track: i64, shift_px: f64, noise: f64) -> Label {
    let (s, k) = (frame as f64, track as f64);
    let depth = 10.0 + 4.0 * k + 0.15 * s + noise * 0.4 * (0.7 * s + k).sin();
    let x = -3.0 + 2.5 * k + noise * 0.1 * (1.3 * s).cos();
    let (u, v, half, tall) =
        (600.0 + 700.0 * x / depth, 170.0 + 1160.0 / depth, 650.0 / depth, 1050.0 / depth);
    Label {
        frame,
        track,
        class: if track == 2 { "Van" } else { "Car" }.into(),
        truncated: 0.0,
        // Occluded now and then.
        occluded: f64::from(u8::from(noise == 0.0 && frame % 11 == 3)),
        alpha_rad: 0.0,
        bbox: BoundingBox::new(
            [u - half + shift_px, v - tall, u + half + shift_px, v].map(|edge| edge + 3.0 * noise),
        ),
        size_hwl_m: [1.5, 1.6, 3.9],
        location_m: [x, 1.65, depth],
        // Crosses the seam of the angle.
        ry_rad: 3.1 + 0.002 * s + noise * 0.08 - if s > 20.0 { TAU } else { 0.0 },
        score: None,
    }
}

fn write_labels(path: &Path, labels: impl Iterator<Item = Label>) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let lines: Vec<String> = labels.map(|label| label.to_line() + "\n").collect();
    std::fs::write(path, lines.concat()).unwrap();
}

/// Ground truth and a run of frames 5..65 of sequence 0042, camera 3.
fn make(root: &Path, rows_from_zero: bool) {
    let frames = 0..FIRST + FRAMES;
    std::fs::create_dir_all(root.join("calib")).unwrap();
    std::fs::create_dir_all(root.join("gt_poses")).unwrap();
    std::fs::create_dir_all(root.join("run")).unwrap();
    let rest = "0 700 170 2.2 0 0 1 0.0027";
    let calib = format!("P0: 700 0 600 0 0 700 170 0 0 0 1 0\nP3: 700 0 600 -330 {rest}\n");
    std::fs::write(root.join("calib/0042.txt"), calib).unwrap();
    let truth: Vec<_> = frames.clone().map(|frame| camera(frame, 0.0)).collect();
    write_kitti(File::create(root.join("gt_poses/0042.txt")).unwrap(), &truth).unwrap();
    let rows = frames.clone().flat_map(|frame| (0..4).map(move |track| (frame, track)));
    // Track 3 is gone after ten frames: too short to be reported.
    let labelled = rows.filter(|(frame, track)| *track < 3 || *frame < 12);
    write_labels(&root.join("label_02/0042.txt"), labelled.clone().map(|(f, t)| vehicle(f, t, 0.0, 0.0)));
    let in_camera_3 = labelled.clone().map(|(f, t)| vehicle(f, t, -20.0, 0.0));
    let pedestrian = Label { class: "Pedestrian".into(), track: 99, ..vehicle(7, 0, -20.0, 0.0) };
    write_labels(&root.join("label_03/0042.txt"), in_camera_3.chain([pedestrian]));

    let estimate: Vec<_> = frames.clone().skip(FIRST as usize).map(|frame| camera(frame, 1.0)).collect();
    write_kitti(File::create(root.join("run/ego.kitti.txt")).unwrap(), &estimate).unwrap();
    let found =
        labelled.filter(|(frame, track)| *frame >= FIRST && !(frame + *track as u64).is_multiple_of(7));
    let answers = found.map(|(frame, track)| {
        let row = if rows_from_zero { frame - FIRST } else { frame };
        // Track 1 gets a new identity half way.
        let id = if track == 1 && frame > 30 { 77 } else { track + 10 };
        Label { frame: row, track: id, score: Some(0.9), ..vehicle(frame, track, -20.0, 1.0) }
    });
    write_labels(&root.join("run/tracks.kitti.txt"), answers);
}

/// The judge's output for this drive.
const JUDGED: &str = include_str!("judged.json");

/// Numbers side by side; `tolerance` in the unit of the field.
fn compare(report: &Report, judged: &Value) {
    let near = |name: &str, ours: Option<f64>, theirs: &Value, tolerance: f64| match (ours, theirs.as_f64()) {
        (Some(a), Some(b)) => assert!((a - b).abs() <= tolerance, "{name}: we say {a}, the judge {b}"),
        (a, b) => assert_eq!(a, b, "{name}"),
    };
    let (ego, e) = (&report.ego, &judged["ego"]);
    near("frames", Some(ego.frames as f64), &judged["frames"], 0.0);
    near("length", Some(ego.length_m), &judged["length_m"], 0.051);
    near("ATE origin", Some(ego.ate_origin_m), &e["ate_origin_m"], 1e-3);
    near("ATE SE(3)", Some(ego.ate_se3_m), &e["ate_se3_m"], 1e-3);
    near("ATE Sim(3)", ego.ate_sim3_m, &e["ate_sim3_m"], 1e-3);
    near("scale", ego.best_scale, &e["best_scale"], 1e-6);
    near("scale error", ego.scale_error_pct_median, &e["scale_error_pct_median"], 1e-3);
    near("RPE", ego.rpe_m, &e["rpe_m"], 1e-3);
    near("rotation", Some(ego.rotation_end_deg), &e["rotation_end_deg"], 0.01);
    near("drift", ego.rotation_deg_per_100m, &e["rotation_deg_per_100m"], 0.01);
    let theirs = judged["vehicles"].as_object().unwrap();
    let ours = report.vehicles.as_ref().unwrap();
    assert_eq!(ours.len(), theirs.len());
    for vehicle in ours {
        let v = &theirs[&vehicle.label.to_string()];
        let name = |field: &str| format!("vehicle {} {field}", vehicle.label);
        near(&name("frames"), Some(vehicle.frames as f64), &v["frames"], 0.0);
        near(&name("switches"), Some(vehicle.id_switches as f64), &v["id_switches"], 0.0);
        near(&name("coverage"), Some(vehicle.coverage), &v["coverage"], 5.1e-4);
        near(&name("ATE origin"), vehicle.ate_origin_m, &v["ate_origin_m"], 1e-3);
        near(&name("ATE SE(3)"), vehicle.ate_ego_se3_m, &v["ate_ego_se3_m"], 1e-3);
        near(&name("in camera"), vehicle.error_in_camera_m, &v["error_in_camera_m"], 1e-3);
        near(&name("heading"), vehicle.heading_error_deg, &v["heading_error_deg"], 0.01);
    }
    let (Some(mean), m) = (&report.vehicles_mean, &judged["vehicles_mean"]) else {
        assert!(judged["vehicles_mean"].is_null());
        return;
    };
    near("mean coverage", Some(mean.coverage), &m["coverage"], 6e-4);
    near("mean ATE", Some(mean.ate_origin_m), &m["ate_origin_m"], 1e-3);
    near("mean ATE SE(3)", Some(mean.ate_ego_se3_m), &m["ate_ego_se3_m"], 1e-3);
    near("mean in camera", Some(mean.error_in_camera_m), &m["error_in_camera_m"], 1e-3);
    near("switches", Some(mean.id_switches as f64), &m["id_switches"], 0.0);
}

fn judge_script() -> Option<PathBuf> {
    let script = motorcade_testing::shared("tools/judge.py")?;
    let numpy = Command::new("python3").args(["-c", "import numpy"]).output();
    if numpy.is_ok_and(|output| output.status.success()) {
        return Some(script);
    }
    println!("skipped the judge itself: python3 with numpy is not there");
    None
}

fn judge(script: &Path, run: &Path, kitti: &Path, sequence: &str, camera: u8, first: u64) -> Value {
    let output = Command::new("python3")
        .arg(script)
        .arg(run)
        .arg("--kitti")
        .arg(kitti)
        .args(["--seq", sequence, "--camera", &camera.to_string(), "--first", &first.to_string()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn we_agree_with_the_judge() {
    let script = judge_script();
    for rows_from_zero in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path(), rows_from_zero);
        let run = folder.path().join("run");
        let report = evaluate_run(&run, folder.path(), "0042", 3, FIRST).unwrap();
        if let Some(script) = &script {
            let judged = judge(script, &run, folder.path(), "0042", 3, FIRST);
            if std::env::var_os("MOTORCADE_REDRAW").is_some() {
                let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/judged.json");
                std::fs::write(path, serde_json::to_string_pretty(&judged).unwrap() + "\n").unwrap();
            }
            compare(&report, &judged);
        }
        compare(&report, &serde_json::from_str(JUDGED).unwrap());
        // The drive is not trivial: each error is there to be seen.
        assert!(report.ego.ate_se3_m > 0.05 && report.ego.rotation_end_deg > 1.0);
        let mean = report.vehicles_mean.as_ref().unwrap();
        assert_eq!((mean.id_switches, mean.reversed_share), (1, 0.0));
        let error_deg = mean.heading_error_deg_median.unwrap();
        assert!((error_deg - mean.heading_error_deg).abs() < 0.01, "{error_deg}");
        assert_eq!(report.vehicles.as_ref().unwrap()[1].estimates, [11, 77]);
        let table = report.to_string();
        assert!(table.contains("ATE, SE(3)") && table.contains("switches"), "{table}");
    }
}

#[test]
fn tum_poses_and_runs_without_tracks() {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path(), false);
    let run = folder.path().join("run");
    let before = evaluate_run(&run, folder.path(), "0042", 3, FIRST).unwrap();
    let rows = (FIRST..FIRST + FRAMES).map(|frame| (frame as i64 * 100_000_000, camera(frame, 1.0)));
    write_tum(File::create(run.join("ego.tum")).unwrap(), rows).unwrap();
    std::fs::remove_file(run.join("ego.kitti.txt")).unwrap();
    std::fs::remove_file(run.join("tracks.kitti.txt")).unwrap();
    let after = evaluate_run(&run, folder.path(), "0042", 3, FIRST).unwrap();
    assert!((after.ego.ate_origin_m - before.ego.ate_origin_m).abs() < 1e-6);
    assert!(after.vehicles.is_none() && after.to_string().contains("gives no tracks"));
}

#[test]
fn mismatched_inputs_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path(), false);
    let run = folder.path().join("run");
    let error = evaluate_run(&run, folder.path(), "0042", 3, FIRST + 1).unwrap_err();
    assert!(error.to_string().contains("60 poses") && error.exit_code() == 1, "{error}");
    let error = evaluate_run(folder.path(), folder.path(), "0042", 3, FIRST).unwrap_err();
    assert!(error.to_string().contains("no run directory") && error.exit_code() == 3, "{error}");
    let error = evaluate_run(&run, folder.path(), "0043", 3, FIRST).unwrap_err();
    assert!(error.to_string().contains("0043.txt"), "{error}");
    std::fs::write(run.join("tracks.kitti.txt"), "5 1 Car 0 0\n").unwrap();
    let error = evaluate_run(&run, folder.path(), "0042", 3, FIRST).unwrap_err();
    assert!(error.to_string().contains("tracks.kitti.txt:1: expected 17 or 18 columns"), "{error}");
}

#[test]
fn we_agree_on_real_ground_truth() {
    let Some(script) = judge_script() else { return };
    let Some(kitti) = script.parent().and_then(Path::parent).map(|root| root.join("kitti/tracking/training"))
    else {
        return;
    };
    for (sequence, camera, first, count) in [("0005", 3, 0, 297), ("0003", 2, 16, 85)] {
        // The estimate is the bent ground truth, the tracks are its moved labels.
        let folder = tempfile::tempdir().unwrap();
        let text = std::fs::read_to_string(kitti.join(format!("gt_poses/{sequence}.txt"))).unwrap();
        let rows = text.lines().skip(first as usize).take(count);
        let bent = rows.enumerate().map(|(i, row)| {
            let mut numbers: Vec<f64> = row.split_whitespace().map(|n| n.parse().unwrap()).collect();
            numbers[3] += 0.3 * (0.05 * i as f64).sin();
            numbers[11] *= 1.01;
            numbers.iter().map(|n| format!("{n:.9e}")).collect::<Vec<_>>().join(" ") + "\n"
        });
        std::fs::write(folder.path().join("ego.kitti.txt"), bent.collect::<String>()).unwrap();
        let labels =
            motorcade_dataset::read_labels(&kitti.join(format!("label_0{camera}/{sequence}.txt"))).unwrap();
        let tracks = labels.into_iter().filter(|label| label.frame >= first && label.frame % 9 != 1);
        let moved = tracks.map(|mut label| {
            label.location_m[2] *= 1.05;
            label.bbox.x1 += 2.0;
            label.ry_rad += 0.05;
            label
        });
        write_labels(&folder.path().join("tracks.kitti.txt"), moved);
        let report = evaluate_run(folder.path(), &kitti, sequence, camera, first).unwrap();
        compare(&report, &judge(&script, folder.path(), &kitti, sequence, camera, first));
        assert!(report.vehicles_mean.unwrap().vehicles >= 2);
    }
}
