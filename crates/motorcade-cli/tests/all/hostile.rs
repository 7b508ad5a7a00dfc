//! Inputs that would hang, crash or fill the memory: refused at once, with the thing named.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::{Answer, answer, drive, json, no_leftovers, nothing_written, without_pictures};

/// Runs and demands an answer soon, on a slow machine too.
#[track_caller]
fn soon(folder: &Path, arguments: &str) -> Answer {
    let start = Instant::now();
    let output = answer(folder, arguments);
    assert!(start.elapsed() < Duration::from_secs(15), "{arguments}: {:?}", start.elapsed());
    output
}

const RUN: &str = "run frames --calibration camera.toml --height 1.5 --out out";

#[test]
fn fifos_sockets_and_devices_are_no_inputs() {
    let folder = drive(2);
    let at = |name: &str| folder.path().join(name);
    assert!(std::process::Command::new("mkfifo").arg(at("fifo")).status().unwrap().success());
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
    for special in ["fifo", "socket", "/dev/zero"] {
        for command in [
            format!("run {special} --calibration camera.toml --height 1.5 --out out"),
            format!("run {special} --format video --calibration camera.toml --height 1.5 --out out"),
            format!("inspect {special}"),
            format!("run frames --calibration {special} --height 1.5 --out out"),
            format!("{RUN} --detections {special}"),
            format!("{RUN} --trajectory {special}"),
            format!("{RUN} --vehicle-poses {special}"),
            format!("{RUN} --keypoints {special}"),
            format!("{RUN} --config {special}"),
            format!("{RUN} --models {special}"),
            format!("{RUN} --ignore {special}"),
            format!("{RUN} --road-masks {special}"),
            format!("graph info {special}"),
            format!("graph optimise {special} --out out"),
            format!("shape info {special}"),
            format!("simulate --trajectory {special} --out out"),
        ] {
            soon(folder.path(), &command).expect(3, &[special]);
        }
    }
    fs::rename(at("fifo"), at("frames/000002.png")).unwrap();
    let output = soon(folder.path(), &RUN.replace("--out out", "--out two"));
    output.expect(output.code, &["000002.png", "FIFO"]);
    nothing_written(folder.path());
}

#[test]
fn absurd_numbers_are_named() {
    let folder = drive(3);
    let at = |name: &str| folder.path().join(name);
    let camera = |from: &str, to: &str| {
        fs::write(at("absurd.toml"), crate::common::CALIBRATION.replace(from, to)).unwrap();
        soon(folder.path(), "run frames --calibration absurd.toml --height 1.5 --out out")
    };
    camera("fx = 390.0", "fx = 1e-300").expect(3, &["absurd.toml", "fx"]);
    camera("fx = 390.0", "fx = 1e300").expect(3, &["absurd.toml", "fx"]);
    camera("cx = 240.0", "cx = 1e300").expect(3, &["absurd.toml", "principal point"]);
    camera("width = 480", "width = 4000000000").expect(3, &["absurd.toml", "4000000000"]);
    camera("fps = 10.0", "fps = 1e300").expect(3, &["absurd.toml", "fps"]);
    for (more, code, named) in [
        ("--height 1e300", 1, "height"),
        ("--fps 1e-300", 1, "--fps"),
        ("--set odometry.klt.max_iterations=1000000000", 1, "odometry.klt.max_iterations"),
        ("--set odometry.klt.max_iterations=1e9", 1, "odometry.klt.max_iterations"),
        ("--set road.advanced.height.step=1e-9", 1, "road.advanced.height.step"),
        ("--set road.advanced.oldest_s=1e300", 1, "road.advanced.oldest_s"),
        ("--frames 18446744073709551614..", 1, "18446744073709551614"),
    ] {
        let usual = if more.contains("--height") { RUN.replace("--height 1.5", "") } else { RUN.to_owned() };
        soon(folder.path(), &format!("{usual} {more}")).expect(code, &[named]);
    }
    for (command, named) in [
        ("simulate --scenario demo --width 4000000000 --out out", "--width"),
        ("simulate --scenario demo --frames 1000000000000 --out out", "--frames"),
        ("simulate --scenario demo --frames 2 --blur-samples 1000000000 --out out", "--blur-samples"),
        ("demo --frames 1000000000000 --out out", "--frames"),
    ] {
        soon(folder.path(), command).expect(1, &[named]);
    }
    nothing_written(folder.path());
}

#[test]
fn a_million_boxes_in_a_frame() {
    let folder = drive(3);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("boxes.csv"), "1,10,20,60,80,0.9\n".repeat(1_000_000)).unwrap();
    soon(folder.path(), &format!("{RUN} --detections boxes.csv"))
        .expect(3, &["boxes.csv:1001", "1000 objects"]);
    let header = "frame,track_id,layout,index,x_px,y_px,confidence\n";
    let points: String = (0..5000).map(|k| format!("1,{k},car-14,0,1,1,0.5\n")).collect();
    fs::write(at("points.csv"), format!("{header}{points}")).unwrap();
    soon(folder.path(), &format!("{RUN} --keypoints points.csv"))
        .expect(3, &["points.csv:1002", "1000 vehicles"]);
    nothing_written(folder.path());
}

#[test]
fn trajectories_that_cannot_be_driven() {
    let folder = drive(3);
    let at = |name: &str| folder.path().join(name);
    let with = |text: &str| {
        fs::write(at("ego.txt"), text).unwrap();
        soon(folder.path(), &format!("{RUN} --trajectory ego.txt --trajectory-scale metric --threads 1"))
    };
    with("0.0 0 0 0 0 0 0 1\n0.2 0 0 1 0 0 0 1\n0.1 0 0 2 0 0 0 1\n").expect(3, &["ego.txt:3", "backwards"]);
    with("0.0 0 0 0 0 0 0 1\n0.1 0 0 1e300 0 0 0 1\n0.2 0 0 2 0 0 0 1\n").expect(3, &["ego.txt:2", "finite"]);
    nothing_written(folder.path());
    // 500 m/s: possible for a file, not for a car.
    let output = with("0.0 0 0 0 0 0 0 1\n0.1 0 0 50 0 0 0 1\n0.2 0 0 100 0 0 0 1\n");
    output.expect(output.code, &["100 m/s", "500 m/s", "frame"]);
}

#[test]
fn cameras_that_are_rarely_meant_are_warned_of_at_once() {
    let folder = drive(6);
    let start = "run frames --calibration camera.toml --out out --threads 1 --height 30";
    let output = answer(folder.path(), start);
    output.expect(output.code, &["warning: the camera height of 30 m"]);
    let (warning, odometry) =
        (output.stderr.find("height of 30 m").unwrap(), output.stderr.find("odometry").unwrap());
    assert!(warning < odometry, "{}", output.stderr);
    let record = json(&folder.path().join("out/run.json"));
    assert!(record["warnings"][0].as_str().unwrap().contains("height of 30 m"));
    for file in fs::read_dir(folder.path().join("out")).unwrap().flatten() {
        let text = without_pictures(&fs::read_to_string(file.path()).unwrap());
        assert!(!text.contains("NaN") && !text.contains("inf,"), "{:?}", file.path());
    }
}

#[test]
fn files_that_are_no_graphs() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("notes.txt"), "Dear reader\nthis is no graph\n").unwrap();
    fs::write(at("empty.g2o"), "").unwrap();
    for name in ["notes.txt", "empty.g2o"] {
        answer(folder.path(), &format!("graph info {name}")).expect(3, &[name, "no vertices"]);
        answer(folder.path(), &format!("graph optimise {name} --out out.g2o")).expect(3, &[name]);
    }
    let vertices = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1e300 0 0\n";
    fs::write(at("far.g2o"), vertices).unwrap();
    answer(folder.path(), "graph info far.g2o").expect(3, &["far.g2o:2", "1e300"]);
    assert!(!at("out.g2o").exists());
}

#[test]
fn drives_that_no_road_can_be_built_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let pose = |z: &str| format!("1 0 0 0 0 1 0 0 0 0 1 {z}\n");
    fs::write(at("poses.txt"), pose("0") + &pose("1")).unwrap();
    fs::write(at("far.txt"), pose("0") + &pose("1e11")).unwrap();
    let label =
        |height: &str| format!("0 7 Car 0 0 -1.6 560 170 640 220 {height} 1.7 4.2 0.5 1.65 12.0 -1.57\n");
    fs::write(at("labels.txt"), label("1e11")).unwrap();
    soon(folder.path(), "simulate --trajectory far.txt --out out").expect(3, &["far.txt", "pose 1"]);
    let output = soon(folder.path(), "simulate --trajectory poses.txt --labels labels.txt --out out");
    output.expect(3, &["labels.txt", "frame 0, track 7"]);
    nothing_written(folder.path());
}

#[test]
fn shorter_drives_leave_no_frames_of_longer_ones() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = |frames: u32, more: &str| {
        answer(
            folder.path(),
            &format!("simulate --scenario demo --width 320 --frames {frames} --out drive {more}"),
        )
    };
    simulate(4, "").expect(0, &[]);
    simulate(2, "").expect(1, &["drive", "--force"]);
    simulate(2, "--force").expect(0, &[]);
    let images = folder.path().join("drive/training/image_02/0000");
    assert_eq!(fs::read_dir(&images).unwrap().count(), 2);
    fs::write(images.join("mine.png"), "mine").unwrap();
    simulate(2, "--force").expect(1, &["in the way", "training/image_02/0000/mine.png"]);
    for frames in [6, 4] {
        answer(folder.path(), &format!("demo --frames {frames} --out demo --progress none"));
        let images = folder.path().join("demo-drive/training/image_02/0000");
        assert_eq!(fs::read_dir(images).unwrap().count(), frames);
        assert_eq!(json(&folder.path().join("demo/run.json"))["counters"]["frames"], frames);
    }
    no_leftovers(folder.path());
}

#[test]
fn an_unknown_height_needs_frames_and_their_end() {
    let folder = drive(3);
    let auto = RUN.replace("--height 1.5", "--height auto");
    soon(folder.path(), &format!("{auto} --online")).expect(1, &["--height auto", "--online"]);
    soon(folder.path(), &RUN.replace("--height 1.5", "--height tall")).expect(1, &["tall", "auto"]);
    soon(folder.path(), &RUN.replace("--height 1.5", "--height -1")).expect(1, &["--height", "-1"]);
    // Nothing to estimate it from: a guess that says so.
    let output = soon(folder.path(), &format!("{auto} --models none"));
    output.expect(output.code, &["height of the camera guessed"]);
    assert_eq!(json(&folder.path().join("out/run.json"))["camera_height_m"], 1.5);
}
