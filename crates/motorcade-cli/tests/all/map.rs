//! Maps of places: kept, driven by, merged, exported, refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use crate::common::{answer, drive};

const RUN: &str = "run frames --calibration camera.toml --height 1.65 --progress none";

fn record(run: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(run.join("run.json")).unwrap()).unwrap()
}

#[test]
fn a_drive_is_in_the_world_of_the_map_that_it_meets() {
    let folder = drive(64);
    let at = folder.path();
    answer(at, &format!("{RUN} --frames ..58 --out first --save-map first.map")).expect(0, &[]);
    // The second drive begins 6 m farther on.
    answer(at, &format!("{RUN} --frames 6.. --out again --map first.map --save-map again.map"))
        .expect(0, &[]);
    let again = record(&at.join("again"));
    assert!(again["map"]["matches"].as_u64().unwrap() >= 5, "{}", again["map"]);
    assert_eq!(again["map"]["digest"].as_str().unwrap().len(), 16);
    assert!(again["world"].as_str().unwrap().contains("--map"));
    assert!(at.join("again/map_matches.csv").exists() && record(&at.join("first")).get("map").is_none());
    // The same pictures have the same poses in both.
    let z_m = |run: &str, row: usize| -> f64 {
        let poses = fs::read_to_string(at.join(run).join("ego.kitti.txt")).unwrap();
        poses.lines().nth(row).unwrap().split(' ').next_back().unwrap().parse().unwrap()
    };
    for row in [0, 20, 45] {
        let (later, first) = (z_m("again", row), z_m("first", row + 6));
        assert!((later - first).abs() < 0.2, "row {row}: {later} and {first}");
    }

    answer(at, "map merge first.map again.map --out both.map").expect(0, &[]);
    let both = answer(at, "map info both.map");
    both.expect(0, &[]);
    assert!(both.stdout.contains("maps not joined    1"), "{}", both.stdout);
    answer(at, "map export both.map --out points.ply").expect(0, &[]);
    answer(at, "map export both.map --out way.geojson --start 49,8,90").expect(0, &[]);
    let way: serde_json::Value = serde_json::from_slice(&fs::read(at.join("way.geojson")).unwrap()).unwrap();
    assert_eq!(way["features"][0]["geometry"]["type"], "LineString");
}

#[test]
fn an_online_run_is_in_the_world_of_the_map_from_the_frame_it_is_met() {
    let folder = drive(64);
    let at = folder.path();
    answer(at, &format!("{RUN} --frames ..58 --online --out first --save-map first.map")).expect(0, &[]);
    let output = answer(at, &format!("{RUN} --frames 6.. --online --out again --map first.map"));
    output.expect(0, &[]);
    let lines: Vec<serde_json::Value> =
        output.stdout.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let revision = lines.iter().find(|line| line.get("revision").is_some()).unwrap();
    // Three sure ones in a row.
    assert!(revision["map"]["matches"].as_u64().unwrap() >= 3, "{revision}");
    assert!(revision["frame"].as_u64().unwrap() < 30, "{revision}");
    let again = record(&at.join("again"));
    assert!(again["map"]["matches"].as_u64().unwrap() >= 5, "{}", again["map"]);
    assert_eq!(again["map"]["first_estimated_frame"], revision["frame"]);
    let z_m = |line: &serde_json::Value| line["camera"]["position_m"][2].as_f64().unwrap();
    let last = lines.iter().rev().find(|line| line["frame"] == 57).unwrap();
    let poses = fs::read_to_string(at.join("first/ego.kitti.txt")).unwrap();
    let first: f64 = poses.lines().nth(57).unwrap().split(' ').next_back().unwrap().parse().unwrap();
    assert!((z_m(last) - first).abs() < 0.3, "{} and {first}", z_m(last));
}

#[test]
fn maps_that_are_none_or_do_not_fit_are_refused() {
    let folder = drive(3);
    let at = folder.path();
    fs::write(at.join("text.map"), "ply\n").unwrap();
    fs::write(at.join("cut.map"), b"MCDRMAP\n\x01\0\0\0cut").unwrap();
    for name in ["text.map", "cut.map", "none.map"] {
        answer(at, &format!("{RUN} --out run --map {name}")).expect(3, &[name]);
        answer(at, &format!("map info {name}")).expect(3, &[name]);
        answer(at, &format!("map merge {name} text.map --out both.map")).expect(3, &[".map"]);
    }
    assert!(!at.join("run").exists() && !at.join("both.map").exists());
    answer(at, &format!("{RUN} --out run --map text.map --online")).expect(3, &["text.map"]);
}
