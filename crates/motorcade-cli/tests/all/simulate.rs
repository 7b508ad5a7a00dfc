//! `motorcade simulate` on drives made on the spot.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fmt::Write;

use crate::common::answer;

/// Two poses a metre apart and a car 12 m ahead of camera 0.
fn small_drive(folder: &std::path::Path, frames: usize) {
    let (mut poses, mut labels) = (String::new(), String::new());
    for i in 0..frames {
        writeln!(poses, "1 0 0 0 0 1 0 0 0 0 1 {i}").unwrap();
        writeln!(labels, "{i} 7 Car 0 0 -1.6 560 170 640 220 1.5 1.7 4.2 0.5 1.65 12.0 -1.5707963").unwrap();
    }
    std::fs::write(folder.join("poses.txt"), poses).unwrap();
    std::fs::write(folder.join("labels.txt"), labels).unwrap();
    // Camera 3 sits 0.5 m to the right of camera 0.
    let projection = |shift: f64| format!("700 0 600 {shift} 0 700 180 0 0 0 1 0");
    let text = format!("P0: {}\nP2: {}\nP3: {}\n", projection(0.0), projection(0.0), projection(-350.0));
    std::fs::write(folder.join("calib.txt"), text).unwrap();
}

#[test]
fn a_real_drive_is_reenacted() {
    let folder = tempfile::tempdir().unwrap();
    small_drive(folder.path(), 3);
    let command = "simulate --trajectory poses.txt --labels labels.txt --calibration calib.txt --camera 3 --width 414 \
                   --keypoints --out drive --progress none";
    let output = answer(folder.path(), command);
    output.expect(0, &[]);
    assert!(output.stdout.contains("3 frames, 3 labelled boxes"), "{}", output.stdout);
    let training = folder.path().join("drive/training");
    let read = |name: &str| std::fs::read_to_string(training.join(name)).unwrap();
    assert_eq!(std::fs::read_dir(training.join("image_02/0000")).unwrap().count(), 3);
    let label: Vec<f64> = read("label_02/0000.txt")
        .lines()
        .next()
        .unwrap()
        .split(' ')
        .skip(10)
        .map(|v| v.parse().unwrap())
        .collect();
    // The car stands where it stood, seen from camera 3, on a road 1.65 m below.
    assert!(
        (label[3] - 0.0).abs() < 0.01 && (label[4] - 1.65).abs() < 0.05 && (label[5] - 12.0).abs() < 0.01,
        "{label:?}"
    );
    let poses = read("gt_poses/0000.txt");
    let last: f64 = poses.lines().last().unwrap().split(' ').next_back().unwrap().parse().unwrap();
    assert!((last - 2.0).abs() < 1e-6, "{poses}");
    let keypoints = read("keypoints/0000.csv");
    assert!(keypoints.starts_with("frame,track_id,layout,index,name,x_px,y_px,confidence\n"));
    assert!(keypoints.contains("0,7,car-36,") && keypoints.contains("2,7,car-14,"));
}

#[test]
fn geometry_alone_writes_tables_and_no_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let command =
        |out: &str| format!("simulate --scenario demo --frames 4 --geometry-only --outliers 0 --out {out}");
    answer(folder.path(), &command("one")).expect(0, &[]);
    answer(folder.path(), &command("two")).expect(0, &[]);
    for kind in ["landmarks", "points", "road_matches", "keypoints"] {
        let read =
            |out: &str| std::fs::read(folder.path().join(format!("{out}/training/{kind}/0000.csv"))).unwrap();
        assert!(read("one") == read("two") && read("one").len() > 200, "{kind}");
    }
    assert!(!folder.path().join("one/training/image_02").exists());
}

#[test]
fn training_crops_are_arrays_that_say_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let made = answer(folder.path(), "simulate --training vehicle --count 3 --out crops");
    made.expect(0, &[]);
    assert!(made.stdout.starts_with("3 crops\n"), "{}", made.stdout);
    let header = std::fs::read(folder.path().join("crops/crops.npy")).unwrap();
    assert!(String::from_utf8_lossy(&header[..128]).contains("'shape': (3, 96, 96, 3,)"));
    let text = std::fs::read_to_string(folder.path().join("crops/crops.json")).unwrap();
    assert!(text.contains("\"count\": 3") && text.contains("heading_rad"), "{text}");
    // A second one does not write over it.
    answer(folder.path(), "simulate --training vehicle --count 3 --out crops").expect(1, &["not empty"]);
}

#[test]
fn a_shorter_drive_in_the_place_of_a_longer_one_is_as_if_it_were_alone() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = |frames: u32, out: &str| {
        let command = format!("simulate --scenario demo --width 320 --frames {frames} --out {out} --force");
        answer(folder.path(), &command).expect(0, &[]);
    };
    let text = |out: &str, kind: &str| {
        std::fs::read_to_string(folder.path().join(format!("{out}/training/{kind}/0000.txt"))).unwrap()
    };
    simulate(6, "drive");
    assert_eq!(text("drive", "gt_poses").lines().count(), 6);
    simulate(3, "drive");
    simulate(3, "alone");
    assert_eq!(text("drive", "gt_poses").lines().count(), 3);
    let frames: Vec<u32> = text("drive", "label_02")
        .lines()
        .map(|line| line.split(' ').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!((frames.first(), frames.last()), (Some(&0), Some(&2)));
    for kind in ["gt_poses", "label_02", "detections", "calib"] {
        assert_eq!(text("drive", kind), text("alone", kind), "{kind}");
    }
    for kind in ["image_02", "road_masks"] {
        let images = folder.path().join(format!("drive/training/{kind}/0000"));
        assert_eq!(std::fs::read_dir(images).unwrap().count(), 3, "{kind}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    small_drive(folder.path(), 3);
    std::fs::write(folder.path().join("torn.txt"), "1 0 0 0 0\n").unwrap();
    for (command, code, said) in [
        ("simulate --trajectory poses.txt --frames 9 --out d", 1, "holds 3 poses"),
        ("simulate --trajectory poses.txt --height 0 --out d", 1, "--height"),
        ("simulate --trajectory nowhere.txt --out d", 3, "nowhere.txt"),
        ("simulate --trajectory torn.txt --out d", 3, "torn.txt"),
        ("simulate --trajectory poses.txt --labels torn.txt --out d", 3, "torn.txt"),
        ("simulate --trajectory poses.txt --calibration calib.txt --camera 1 --out d", 3, "has no camera 1"),
        ("simulate --labels labels.txt --scenario demo --out d", 1, "--trajectory"),
        ("simulate --trajectory poses.txt --scenario demo --out d", 1, "cannot be used with"),
        ("simulate --scenario demo --weather hail --out d", 1, "known are clear, overcast, rain"),
        ("simulate --training vehicle --count 0 --out d", 1, "at least one crop"),
        ("simulate --training vehicle --scenario demo --out d", 1, "cannot be used with"),
        ("simulate --scenario demo --exact --out d", 1, "--keypoints"),
        ("simulate --scenario demo --exposure-drift=-1 --out d", 1, "exposure"),
        ("simulate --scenario demo --readout-ms 300 --out d", 1, "readout time"),
        ("simulate --scenario demo --geometry-only --outliers 2 --out d", 1, "outliers"),
    ] {
        answer(folder.path(), command).expect(code, &[said]);
        assert!(!folder.path().join("d").exists(), "{command}");
    }
}
