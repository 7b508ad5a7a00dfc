//! `motorcade draw` and `motorcade run --overlay`.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use crate::common::{Answer, answer, drive, json, no_leftovers, program, run};

/// Boxes of a car that keeps 12 m ahead on the left, 1.6 m wide and 1.5 m high.
fn boxes(folder: &Path, frames: u64) {
    let line = |k: u64| format!("{k},149,105,201,153.8,0.9\n");
    fs::write(folder.join("boxes.csv"), (0..frames).map(line).collect::<String>()).unwrap();
}

/// Runs the program with nothing but these programs in its path.
fn with_path(folder: &Path, path: &str, arguments: &str) -> Answer {
    program(folder, arguments).env("PATH", path).output().unwrap().into()
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn pictures_show_vehicles_and_are_replaced_only_when_asked() {
    let folder = drive(16);
    boxes(folder.path(), 16);
    run(folder.path(), "--detections boxes.csv").expect(0, &[]);
    let drawn = answer(folder.path(), "draw out --out pictures --progress none");
    assert!(drawn.expect(0, &[]).stdout.contains("16 frames drawn\npictures"), "{}", drawn.stdout);
    let names = files(&folder.path().join("pictures"));
    assert_eq!((names.len(), names[0].as_str(), names[16].as_str()), (17, "000000.png", "overlay.json"));
    // Grey frames; the outline of the vehicle is coloured, the sky above it is not.
    let picture = image::open(folder.path().join("pictures/000008.png")).unwrap().to_rgb8();
    assert!(picture.width() > 480 && picture.height() == 240);
    let coloured = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        let strong = |p: [u8; 3]| p[0].abs_diff(p[1]).max(p[1].abs_diff(p[2])) > 50;
        x.flat_map(|x| y.clone().map(move |y| (x, y)))
            .filter(|(x, y)| strong(picture.get_pixel(*x, *y).0))
            .count()
    };
    assert!(coloured(140..210, 95..165) > 60);
    assert_eq!(coloured(260..470, 5..60), 0);
    // The same again, on one thread: the same bytes.
    let first = fs::read(folder.path().join("pictures/000008.png")).unwrap();
    answer(folder.path(), "draw out --out pictures").expect(1, &["pictures", "--force"]);
    answer(folder.path(), "draw out --out drawn.gif")
        .expect(1, &["drawn.gif", ".mp4", "a folder for pictures"]);
    assert!(!folder.path().join("drawn.gif").exists());
    answer(folder.path(), "draw out --out pictures --force --threads 1 --frames 5..9").expect(0, &[]);
    assert_eq!(files(&folder.path().join("pictures")).len(), 5);
    assert_eq!(fs::read(folder.path().join("pictures/000008.png")).unwrap(), first);
    no_leftovers(folder.path());
}

#[test]
fn the_input_is_that_of_the_run_or_the_one_given() {
    let folder = drive(14);
    run(folder.path(), "--stride 2").expect(0, &[]);
    fs::rename(folder.path().join("frames"), folder.path().join("moved")).unwrap();
    answer(folder.path(), "draw out --out pictures").expect(3, &["frames", "draw RUN INPUT"]);
    answer(folder.path(), "draw out moved --out pictures").expect(0, &[]);
    assert_eq!(files(&folder.path().join("pictures")).len(), 8, "every second of 14, and the list");
    answer(folder.path(), "draw out moved --out none --frames 90..").expect(1, &["no frame", "90.."]);
    fs::write(folder.path().join("camera.toml"), "fx = 300.0\nfy = 390.0\ncx = 240.0\ncy = 105.0\n").unwrap();
    answer(folder.path(), "draw out moved --out none").expect(3, &["moved", "intrinsics"]);
    answer(folder.path(), "draw nowhere --out none").expect(3, &["nowhere/run.json"]);
    let tracks = folder.path().join("out/frames.csv");
    let text = fs::read_to_string(&tracks).unwrap();
    fs::write(&tracks, text.replacen("tracked", "tracked,x", 1)).unwrap();
    answer(folder.path(), "draw out moved --out none").expect(3, &["frames.csv:"]);
    assert!(!folder.path().join("none").exists());
    no_leftovers(folder.path());
}

#[test]
fn without_ffmpeg_pictures_take_the_place_of_a_video() {
    let folder = drive(12);
    let arguments =
        "run frames --calibration camera.toml --height 1.5 --out out --overlay out/o.mp4 --progress none";
    let output = with_path(folder.path(), "/nowhere", arguments);
    output.expect(0, &["ffmpeg is not installed", "PNG"]);
    assert!(output.stdout.ends_with("out/o\n"), "{}", output.stdout);
    assert_eq!(files(&folder.path().join("out/o")).len(), 13);
    // Listed: a later run replaces them.
    let listed = json(&folder.path().join("out/run.json"))["files"].to_string();
    assert!(listed.contains("o/000003.png"), "{listed}");
    with_path(folder.path(), "/nowhere", &format!("{arguments} --force")).expect(0, &[]);
    no_leftovers(folder.path());
}

#[test]
fn an_ffmpeg_that_fails_leaves_nothing() {
    use std::os::unix::fs::PermissionsExt;
    let folder = drive(12);
    run(folder.path(), "--progress none").expect(0, &[]);
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).unwrap();
    fs::write(bin.join("ffmpeg"), "#!/bin/sh\necho no space in the attic >&2\nexit 3\n").unwrap();
    fs::set_permissions(bin.join("ffmpeg"), fs::Permissions::from_mode(0o755)).unwrap();
    let output = with_path(folder.path(), &bin.display().to_string(), "draw out --out o.mp4 --progress none");
    output.expect(5, &["ffmpeg", "o.mp4", "attic"]);
    // A run keeps its results, and says why there is no drawing.
    let again = "run frames --calibration camera.toml --height 1.5 --out two --overlay o.mp4 --progress none";
    with_path(folder.path(), &bin.display().to_string(), again).expect(5, &["attic"]);
    assert!(folder.path().join("two/run.json").is_file() && !folder.path().join("o.mp4").exists());
    no_leftovers(folder.path());
    no_leftovers(&folder.path().join("two"));
}

#[test]
fn a_video_has_the_frames_and_the_rate_of_the_drive() {
    if std::process::Command::new("ffmpeg").arg("-version").output().is_err() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let simulate = "simulate --scenario demo --frames 12 --fps 20 --width 320 --out drive --progress none";
    answer(folder.path(), simulate).expect(0, &[]);
    let usual = "run drive/training --sequence 0000 --fps 20 --detections drive/training/detections/0000.txt \
                 --out out --progress none --overlay o.mp4";
    let output = answer(folder.path(), usual);
    assert!(output.expect(0, &[]).stdout.ends_with("o.mp4\n"), "{}", output.stdout);
    let shown = answer(folder.path(), "inspect o.mp4 --json").expect(0, &[]).stdout.clone();
    let summary: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(summary["frames"], 12);
    assert!((summary["interval_s"].as_f64().unwrap() - 0.05).abs() < 1e-3, "{summary}");
    assert!(summary["width"].as_u64().unwrap() > 320);
    let first = fs::read(folder.path().join("o.mp4")).unwrap();
    answer(folder.path(), "draw out --out o.mp4").expect(1, &["o.mp4", "--force"]);
    answer(folder.path(), "draw out --out o.mp4 --force --progress none").expect(0, &[]);
    assert!(fs::read(folder.path().join("o.mp4")).unwrap() == first, "the same bytes");
    // The run is there, its drawing is not.
    fs::remove_file(folder.path().join("o.mp4")).unwrap();
    let again = answer(folder.path(), usual);
    assert!(again.expect(0, &[]).stdout.contains("already holds this run"), "{}", again.stdout);
    assert!(folder.path().join("o.mp4").is_file());

    // A run of the video knows its input: nothing is drawn over it.
    let number = |name: &str| summary[name].as_f64().unwrap();
    let middle = [number("width") / 2.0, number("height") / 2.0];
    let camera = format!("fx = 300\nfy = 300\ncx = {}\ncy = {}\n", middle[0], middle[1]);
    fs::write(folder.path().join("camera.toml"), camera).unwrap();
    let run = "run o.mp4 --calibration camera.toml --height 1.5 --models none --out of-video --progress none";
    answer(folder.path(), run).expect(0, &[]);
    answer(folder.path(), "draw of-video --out o.mp4 --force").expect(1, &["the input and --out", "o.mp4"]);
    assert!(fs::read(folder.path().join("o.mp4")).unwrap() == first);
    no_leftovers(folder.path());
}

#[test]
fn a_recording_holds_every_frame_and_the_vehicles() {
    let folder = drive(16);
    boxes(folder.path(), 16);
    answer(
        folder.path(),
        "run frames --calibration camera.toml --height 1.5 --detections boxes.csv --out out --mcap out/drive.mcap --progress none",
    )
    .expect(0, &[]);
    let recording = fs::read(folder.path().join("out/drive.mcap")).unwrap();
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for message in mcap::MessageStream::new(&recording).unwrap() {
        *counts.entry(message.unwrap().channel.topic.clone()).or_default() += 1;
    }
    for topic in [
        "/camera/image",
        "/camera/calibration",
        "/camera/annotations",
        "/camera/pose",
        "/tf",
        "/vehicles",
        "/speeds",
    ] {
        assert_eq!(counts.get(topic), Some(&16), "{topic}: {counts:?}");
    }
    assert_eq!(counts.get("/camera/path"), Some(&1));
    // It is one of the run's files, and the same when it is made from them again.
    let record = json(&folder.path().join("out/run.json"));
    assert!(record["files"].as_array().unwrap().iter().any(|file| file["name"] == "drive.mcap"));
    answer(folder.path(), "draw out --out again.mcap").expect(0, &[]);
    assert_eq!(fs::read(folder.path().join("again.mcap")).unwrap(), recording);
    answer(folder.path(), "draw out --out again.mcap").expect(1, &["again.mcap is already there", "--force"]);
    answer(folder.path(), "run frames --calibration camera.toml --height 1.5 --out other --mcap other.bag")
        .expect(1, &["--mcap other.bag", ".mcap"]);
    fs::remove_file(folder.path().join("out/speeds.csv")).unwrap();
    answer(folder.path(), "draw out --out third.mcap").expect(3, &["speeds.csv"]);
    no_leftovers(folder.path());
}

#[test]
fn a_recording_for_ros_2_holds_the_same_drive() {
    let folder = drive(16);
    boxes(folder.path(), 16);
    let usual =
        "run frames --calibration camera.toml --height 1.5 --detections boxes.csv --out out --progress none";
    answer(folder.path(), &format!("{usual} --mcap-schemas ros2")).expect(1, &["--mcap <FILE.mcap>"]);
    answer(folder.path(), &format!("{usual} --mcap out/ros.mcap --mcap-schemas ros2")).expect(0, &[]);
    let recording = fs::read(folder.path().join("out/ros.mcap")).unwrap();
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for message in mcap::MessageStream::new(&recording).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("ros2msg", "cdr"));
        assert!(
            !schema.data.is_empty() && message.data.starts_with(&[0, 1, 0, 0]),
            "{}",
            message.channel.topic
        );
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
    }
    for topic in [
        "/camera/image/compressed",
        "/camera/camera_info",
        "/camera/pose",
        "/tf",
        "/vehicles",
        "/speeds/speed_mps",
    ] {
        assert_eq!(counts.get(topic), Some(&16), "{topic}: {counts:?}");
    }
    assert_eq!(counts.get("/camera/path"), Some(&1));
    answer(folder.path(), "draw out --out again.mcap --mcap-schemas ros2").expect(0, &[]);
    assert_eq!(fs::read(folder.path().join("again.mcap")).unwrap(), recording);
    no_leftovers(folder.path());
}
