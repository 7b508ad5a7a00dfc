//! Readers of manifests, of tables and of evaluations on damaged files, as those of motorcade (`crates/motorcade/tests/fuzz`):
//! `MOTORCADE_FUZZ_SECONDS=60 cargo test --release -p motorcade-fleet --test fuzz -- --nocapture`.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::path::Path;

use motorcade_evaluate::Estimates;
use motorcade_fleet::Manifest;
use motorcade_tables::{Column, RunFiles, Table, Values, parquet_bytes, read_rows};
use motorcade_testing::fuzz::{beside, fuzz, texts};

const CSV: &str = "id,input,height,camera,fps,keep_perception,settings\none,a.mp4,1.4,2,10,true,a.b=1;c.d=2\n\"two\",\"b, c.mp4\",auto,,,,\n,videos/d e.mp4,,,,,\n";
const JSONL: &str = "{\"input\": \"a.mp4\", \"height\": 1.4, \"keep_perception\": true, \"fps\": null}\n\n{\"id\": \"b\", \"input\": \"b\", \"vehicle-poses\": [\"p.csv\", \"q.csv\"]}\n";

#[test]
fn manifests() {
    let read = |path: &Path| Manifest::read(path, &[("height", "1.5".to_owned())]).is_ok();
    fuzz("manifests", &texts(&[("m.csv", CSV), ("m.jsonl", JSONL)]), &[], read);
}

/// Parquet as another program may write it, behind manifests.
#[test]
fn parquet() {
    let column = |name: &str, values| Column {
        name: name.into(),
        unit: String::new(),
        description: String::new(),
        values,
    };
    let text = |all: &[&str]| Values::Text(all.iter().map(|v| Some((*v).to_owned())).collect());
    let columns = vec![
        column("id", text(&["a", "b"])),
        column("input", text(&["a.mp4", "b.mp4"])),
        column("height", Values::F64(vec![Some(1.4), None])),
        column("camera", Values::U64(vec![None, Some(2)])),
    ];
    let table = Table { name: "drives".into(), description: String::new(), columns };
    let sample = parquet_bytes(&table, &[]).unwrap();
    fuzz("parquet", &[("m.parquet", &sample)], &[], |path| read_rows(path).is_ok());
    fuzz("parquet manifests", &[("m.parquet", &sample)], &[], |path| Manifest::read(path, &[]).is_ok());
}

const FRAMES: &str = "frame,time_s,status,inliers,speed_mps,scale_sigma_rel,scale_measured,road_pitch_rad,road_roll_rad,lane_m,note\n\
    5,0.500000,tracked,120,0.000000,0.02,true,0,0,1.5,a\n7,0.700000,bridged,0,8.000000,0.02,false,0.1,-0.02,,\n";
const TRACKS: &str =
    "frame,time_s,id,class,x_m,y_m,z_m,source,p_moving,score\n7,0.700000,3,Car,1,1.5,20.123456,box,0.9,0.8\n";
const EGO: &str = "0.500000001 0 0 0 0 0 0 1\n0.7 0 0 1.6 0 0 0 1\n";

#[test]
fn tables_of_runs() {
    let whole = texts(&[("frames.csv", FRAMES), ("tracks.csv", TRACKS), ("ego.tum", EGO)]);
    fuzz("tables of runs", &whole, &[], |path| {
        beside(path, &whole);
        let Ok(files) = RunFiles::read(path.parent().unwrap()) else { return false };
        let tables = files.frames("drive").and_then(|frames| Ok((frames, files.tracks("drive")?)));
        tables.is_ok_and(|(frames, tracks)| frames.bytes().is_ok() && tracks.bytes().is_ok())
    });
}

const LABELS: &str = "0 3 Car -1 -1 -1.57 120.5 170 220.25 240 1.5 1.6 3.9 -2.5 1.65 14.2 -1.6 0.93\n1 4 Van -1 -1 0.3 1 2 300 200 2.1 1.9 5 3 1.7 22 1.5 0.5\n";

#[test]
fn evaluated_runs() {
    let covariances = format!("frame{}\n0{}\n1{}\n", ",c".repeat(21), ",0.5".repeat(21), ",1e-3".repeat(21));
    let files = [
        ("ego.kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.01 0 1 0 0 0 0 1 0.9\n"),
        ("ego_covariance.csv", &covariances),
        ("tracks.kitti.txt", LABELS),
    ];
    let whole = texts(&files);
    fuzz("evaluated runs", &whole, &[], |path| {
        beside(path, &whole);
        Estimates::read(path.parent().unwrap()).is_ok()
    });
}
