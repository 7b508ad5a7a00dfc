//! Perception that is kept, and a run on it.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;

use crate::common::{answer, drive, json};

const RUN: &str = "run frames --calibration camera.toml --height 1.5 --threads 1 --progress none";

#[test]
fn a_run_on_kept_perception_writes_the_same_results() {
    let folder = drive(8);
    let at = |name: &str| folder.path().join(name);
    // The networks inside the program: `answer` sets none, and `--models` of an empty name is not that.
    let own = |more: &str| {
        let mut command = crate::common::program(folder.path(), &format!("{RUN} {more}"));
        command.env_remove("MOTORCADE_MODELS");
        crate::common::Answer::from(command.output().unwrap())
    };
    own("--keep-perception --out live").expect(0, &[]);
    answer(folder.path(), &format!("{RUN} --perception live/perception.jsonl --out again")).expect(0, &[]);
    let kept = fs::read_to_string(at("live/perception.jsonl")).unwrap();
    assert_eq!(kept.lines().count(), 9);
    assert!(kept.contains("\"road\":{\"image_size\""), "{}", &kept[..200]);
    for name in ["ego.tum", "ego_covariance.csv", "frames.csv", "tracks.csv", "detections.txt"] {
        let read = |run: &str| fs::read(at(run).join(name)).unwrap();
        assert!(read("live") == read("again"), "{name}");
    }
    let of = |run: &str| json(&at(run).join("run.json"))["perception"].clone();
    assert_eq!(of("live"), of("again"));
}

/// Boxes, keypoints and road, all of which the results need.
#[test]
fn a_run_on_kept_vehicles_and_keypoints_writes_the_same_results() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let render = "simulate --scenario demo --frames 16 --width 400 --out drive --progress none";
    answer(folder.path(), render).expect(0, &[]);
    let run = "run drive/training --sequence 0000 --threads 1 --progress none";
    let mut command = crate::common::program(folder.path(), &format!("{run} --keep-perception --out live"));
    let live: crate::common::Answer = command.env_remove("MOTORCADE_MODELS").output().unwrap().into();
    live.expect(0, &[]);
    answer(folder.path(), &format!("{run} --perception live/perception.jsonl --out again")).expect(0, &[]);
    let kept = fs::read_to_string(at("live/perception.jsonl")).unwrap();
    let frames: Vec<serde_json::Value> =
        kept.lines().skip(1).map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(frames.len(), 16);
    let count = |list: &str| frames.iter().filter(|f| !f[list].as_array().unwrap().is_empty()).count();
    assert_eq!(count("detections"), 16);
    // Looked for every few frames: those of each vehicle lie beside its boxes.
    let points = frames.iter().flat_map(|frame| frame["keypoints"].as_array().unwrap());
    assert!(points.clone().all(|found| found["points"].as_array().unwrap().len() >= 14));
    assert!(count("keypoints") >= 5 && points.count() >= 5, "{}", count("keypoints"));
    assert!(frames.iter().all(|frame| frame["road"].is_object()));
    let tracks = fs::read_to_string(at("live/tracks.csv")).unwrap();
    assert!(tracks.lines().count() > 16, "{tracks}");
    // All that is listed but the page, which holds times, and what was kept; of vehicles too.
    let record = json(&at("live/run.json"));
    let listed = record["files"].as_array().unwrap().iter().map(|file| file["name"].as_str().unwrap());
    let names: Vec<&str> =
        listed.filter(|name| !["report.html", "perception.jsonl"].contains(name)).collect();
    for name in ["ego.tum", "frames.csv", "tracks.csv", "tracks.kitti.txt"] {
        assert!(names.contains(&name), "{names:?}");
    }
    for name in names {
        let read = |run: &str| fs::read(at(run).join(name)).unwrap();
        assert!(read("live") == read("again"), "{name}");
    }
}

#[test]
fn perception_of_another_drive_is_refused() {
    let folder = drive(4);
    let header = r#"{"motorcade_perception":1,"vehicles":"v","road":null,"keypoints":null}"#;
    let frame = |n: u32| format!(r#"{{"frame":{n},"detections":[],"road":null,"keypoints":[]}}"#);
    let with = |lines: &[String]| {
        let text = [&[header.to_owned()], lines].concat().join("\n");
        fs::write(folder.path().join("kept.jsonl"), text).unwrap();
        answer(folder.path(), &format!("{RUN} --perception kept.jsonl --force --out out"))
    };
    with(&[frame(70)]).expect(1, &["kept.jsonl", "4 of 4 frames", "the first one 0"]);
    with(&[frame(0), frame(1), frame(2)]).expect(0, &["warning", "1 of 4 frames", "the first one 3"]);
    with(&[frame(0), frame(0)]).expect(3, &["kept.jsonl:3", "frame 0 a second time"]);
    let both = format!("{RUN} --perception kept.jsonl --detections boxes.txt --out two");
    answer(folder.path(), &both).expect(1, &["--detections"]);
}
