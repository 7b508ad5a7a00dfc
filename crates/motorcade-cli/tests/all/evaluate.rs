//! `motorcade evaluate` on a drive whose truth is known.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use crate::common::{STEP_M, answer, frame_file, json, no_leftovers, street};

const FIRST: u64 = 3;
const FRAMES: u64 = 20;

/// A KITTI tracking split with one sequence, cameras at cam0.
fn split(root: &Path) {
    for folder in ["image_02/0007", "calib", "gt_poses", "label_02"] {
        fs::create_dir_all(root.join(folder)).unwrap();
    }
    for number in 0..FIRST + FRAMES {
        street(number as f64 * STEP_M).save(frame_file(&root.join("image_02/0007"), number)).unwrap();
    }
    let projection = "390 0 240 0 0 390 105 0 0 0 1 0";
    let calibration: String = (0..4).map(|k| format!("P{k}: {projection}\n")).collect();
    let rest = "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0\nTr_imu_to_velo: 1 0 0 0 0 1 0 0 0 0 1 0\n";
    fs::write(root.join("calib/0007.txt"), calibration + rest).unwrap();
    let pose = |k: u64| format!("1 0 0 0 0 1 0 0 0 0 1 {}\n", k as f64 * STEP_M);
    fs::write(root.join("gt_poses/0007.txt"), (0..FIRST + FRAMES).map(pose).collect::<String>()).unwrap();
    fs::write(root.join("label_02/0007.txt"), "").unwrap();
}

#[test]
fn a_run_is_compared_with_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    split(&folder.path().join("training"));
    let run = "run training --sequence 0007 --height 1.5 --out out --frames 3.. --progress none";
    answer(folder.path(), run).expect(0, &[]);
    // Sequence, camera and first frame are stated by the run itself.
    let table = answer(folder.path(), "evaluate out --kitti training --json errors.json");
    table.expect(0, &[]);
    for part in [
        "KITTI tracking 0007 camera 2: 20 frames from 3, 19.0 m",
        "ATE, first pose",
        "ATE, SE(3)",
        "ATE, Sim(3)",
    ] {
        assert!(table.stdout.contains(part), "no `{part}` in:\n{}", table.stdout);
    }
    let errors = json(&folder.path().join("errors.json"));
    assert_eq!((errors["first"].as_u64(), errors["camera"].as_u64()), (Some(FIRST), Some(2)));
    // All said aloud gives the same.
    let aloud = "evaluate out --kitti training --sequence 0007 --camera 2 --first 3";
    assert_eq!(answer(folder.path(), aloud).expect(0, &[]).stdout, table.stdout);
    no_leftovers(folder.path());
}

#[test]
fn errors_are_those_that_are_there() {
    let folder = tempfile::tempdir().unwrap();
    split(&folder.path().join("training"));
    // A tenth too long and nothing else wrong, from another program: no run.json.
    let pose = |k: u64| format!("1 0 0 0 0 1 0 0 0 0 1 {}\n", 1.1 * k as f64 * STEP_M);
    let made = folder.path().join("made");
    fs::create_dir(&made).unwrap();
    fs::write(made.join("ego.kitti.txt"), (0..FRAMES).map(pose).collect::<String>()).unwrap();
    let table =
        answer(folder.path(), "evaluate made --kitti training --sequence 0007 --first 3 --json errors.json");
    table.expect(0, &[]);
    let ego = &json(&folder.path().join("errors.json"))["ego"];
    let value = |name: &str| ego[name].as_f64().unwrap();
    let squares: f64 = (0..FRAMES).map(|k| (0.1 * k as f64 * STEP_M).powi(2)).sum();
    assert!((value("ate_origin_m") - (squares / FRAMES as f64).sqrt()).abs() < 1e-9);
    assert!((value("best_scale") - 1.0 / 1.1).abs() < 1e-9 && value("ate_sim3_m") < 1e-9);
    assert!((value("scale_error_pct_median") - 10.0).abs() < 1e-9);
    assert!(table.stdout.contains("the run gives no tracks"), "{}", table.stdout);
}

#[cfg(unix)]
#[test]
fn errors_are_written_through_links_and_into_streams() {
    use crate::common::places::{Fifo, Link, make_fifo};
    let folder = tempfile::tempdir().unwrap();
    split(&folder.path().join("training"));
    let pose = |k: u64| format!("1 0 0 0 0 1 0 0 0 0 1 {}\n", k as f64 * STEP_M);
    fs::create_dir(folder.path().join("made")).unwrap();
    let poses: String = (0..FRAMES).map(pose).collect();
    fs::write(folder.path().join("made/ego.kitti.txt"), poses).unwrap();
    let evaluate = |json: &str| {
        answer(folder.path(), &format!("evaluate made --kitti training --sequence 0007 --json {json}"))
    };
    let (link, fifo) = (Link::new(folder.path().join("link")), Fifo::new(folder.path().join("fifo")));
    evaluate("link").expect(0, &[]);
    evaluate("fifo").expect(0, &[]);
    let text = link.text();
    assert_eq!(fifo.text(), text);
    let errors: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(errors["ego"]["ate_se3_m"].as_f64().unwrap() < 1e-9, "{errors}");
    // Nobody reads: an error at once, not a program that waits.
    make_fifo(&folder.path().join("unread"));
    evaluate("unread").expect(5, &["unread", "no process reads"]);
    no_leftovers(folder.path());
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    split(&folder.path().join("training"));
    let run = "run training --sequence 0007 --height 1.5 --out out --progress none";
    answer(folder.path(), run).expect(0, &[]);
    let evaluate = |more: &str| answer(folder.path(), &format!("evaluate {more}"));
    for _ in 0..2 {
        evaluate("out --kitti training --json errors.json").expect(0, &[]);
    }
    evaluate("out --kitti training --first 9").expect(1, &["23 poses"]);
    evaluate("out --kitti training --sequence 0009").expect(3, &["0009"]);
    evaluate("out --kitti nowhere").expect(3, &["nowhere"]);
    evaluate("nowhere --kitti training --sequence 0007").expect(3, &["nowhere"]);
    evaluate("nowhere --kitti training").expect(1, &["--sequence"]);
    evaluate("out --kitti training --json nowhere/errors.json").expect(5, &["nowhere/errors.json"]);
    no_leftovers(folder.path());
}
