//! The camera of a drive that nobody calibrated.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

mod common;

use common::{answer, drive, json};
use tempfile::TempDir;

/// Focal length of a TOML calibration \[px\].
fn focal_px(text: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix("fx = ")).unwrap();
    line.parse().unwrap()
}

#[test]
fn a_drive_with_turns_tells_the_focal_length() {
    let folder = TempDir::new().unwrap();
    let render =
        "simulate --scenario figure-eight --frames 60 --width 414 --view-deg 62 --out drive --progress none";
    answer(folder.path(), render).expect(0, &[]);
    let calibrate = "calibrate drive/training --models none --out camera.toml";
    let said = answer(folder.path(), calibrate).stdout;
    for part in ["focal length", "principal point", "distortion k1", "mounting", "camera.toml"] {
        assert!(said.contains(part), "{said}");
    }
    let text = std::fs::read_to_string(folder.path().join("camera.toml")).unwrap();
    let truth = 0.5 * 414.0 / 31_f64.to_radians().tan();
    assert!((focal_px(&text) / truth).ln().abs() < 0.05, "{truth}: {text}");
    answer(folder.path(), "inspect drive/training --calibration camera.toml").expect(0, &[]);
    // A file that is there is not replaced unasked.
    answer(folder.path(), calibrate).expect(1, &["camera.toml is there already", "--force"]);

    let run = "run drive/training --calibration auto --models none --out out --progress none";
    answer(folder.path(), run).expect(0, &[]);
    let kept = std::fs::read_to_string(folder.path().join("out/camera.toml")).unwrap();
    assert_eq!(kept, text);
    let recorded = json(&folder.path().join("out/run.json"))["input"]["intrinsics_px"][0].as_f64().unwrap();
    assert!((recorded - focal_px(&kept)).abs() < 0.01, "{recorded}");
    assert!(answer(folder.path(), run).stdout.contains("already holds this run"));
    let draw = "draw out --frames 10..12 --out pictures --progress none";
    assert!(answer(folder.path(), draw).stdout.contains("2 frames drawn"));
}

#[test]
fn a_straight_drive_tells_no_focal_length() {
    let folder = drive(20);
    let calibrate = "calibrate frames --fps 10 --models none --out found.toml --progress none";
    answer(folder.path(), calibrate).expect(3, &["does not tell the focal length", "--view-deg"]);
    assert!(!folder.path().join("found.toml").exists());
    answer(folder.path(), &format!("{calibrate} --calibration camera.toml")).expect(1, &["--view-deg"]);
    answer(folder.path(), &format!("{calibrate} --view-deg 5")).expect(1, &["[10, 150] degrees"]);
}
