use super::*;

use std::fs;
use std::path::{Path, PathBuf};

use parquet::file::reader::{FileReader, SerializedFileReader};

use crate::{Values, read_rows};

const FRAMES: &str = "\
frame,time_s,status,inliers,speed_mps,scale_sigma_rel,scale_measured,road_pitch_rad,road_roll_rad,lane_m,note
5,0.500000,tracked,120,0.000000,0.02,true,0,0,1.5,a
7,0.700000,bridged,0,8.000000,0.02,false,0.1,-0.02,,
9,61.000000,tracked,7,8.250000,0.02,false,0,0,2.5,
";
const TRACKS: &str = "\
frame,time_s,id,class,x_m,y_m,z_m,qx,qy,qz,qw,length_m,width_m,height_m,speed_mps,sigma_forward_m,sigma_left_m,sigma_up_m,source,p_moving,score
7,0.700000,3,Car,1,1.5,20.123456,-0.5,0.5,-0.5,0.5,4,1.8,1.5,9,0.4,0.2,0.1,box,0.9,0.8
9,61.000000,3,Car,1,1.5,20,-0.5,0.5,-0.5,0.5,4,1.8,1.5,9,0.4,0.2,0.1,predicted,0.9,0.8
";

/// A small run.
pub(crate) fn write_run(run: &Path) -> PathBuf {
    fs::create_dir_all(run).unwrap();
    let write = |name: &str, text: &str| fs::write(run.join(name), text).unwrap();
    write("frames.csv", FRAMES);
    write("ego.tum", "0.500000001 0 0 0 0 0 0 1\n0.7 0 0 1.6 0 0 0 1\n61.000000001 0.25 0 1.7 0 0 0 1\n");
    let head: String = (0..21).map(|k| format!(",c{k}")).collect();
    let row = |n: u32| format!("\n{n}{}", ",1".repeat(21));
    write("ego_covariance.csv", &format!("frame{head}{}{}{}\n", row(5), row(7), row(9)));
    write("tracks.csv", TRACKS);
    let command = ["motorcade", "run", "drive.mp4", "--out", "runs/drive"];
    let record = serde_json::json!({"motorcade": "0.1.0", "command": command, "interrupted": false,
        "length_m": 12.5, "camera_height_m": 1.65, "warnings": ["a"]});
    write("run.json", &record.to_string());
    run.to_path_buf()
}

fn run() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let run = write_run(&folder.path().join("drive"));
    (folder, run)
}

#[test]
fn frames_have_types_nulls_poses_and_exact_times() {
    let (_folder, run) = run();
    let frames = frames(&run, "d1").unwrap();
    let values = |name: &str| &frames.table.column(name).unwrap().values;
    assert_eq!(*values("drive_id"), Values::Text(vec![Some("d1".into()); 3]));
    assert_eq!(
        *values("timestamp_ns"),
        Values::I64(vec![Some(500_000_001), Some(700_000_000), Some(61_000_000_001)])
    );
    assert_eq!(*values("frame"), Values::U64(vec![Some(5), Some(7), Some(9)]));
    assert_eq!(*values("scale_measured"), Values::Bool(vec![Some(true), Some(false), Some(false)]));
    assert_eq!(*values("z_m"), Values::F64(vec![Some(0.0), Some(1.6), Some(1.7)]));
    // Columns that are not known: by the end of their names.
    assert_eq!(*values("lane_m"), Values::F64(vec![Some(1.5), None, Some(2.5)]));
    assert_eq!(*values("note"), Values::Text(vec![Some("a".into()), None, None]));
    let column = frames.table.column("speed_mps").unwrap();
    assert!(column.unit == "m/s" && column.description.contains("camera"));
}

#[test]
fn row_groups_are_minutes_of_the_drive() {
    let (_folder, run) = run();
    for (table, rows) in [(frames(&run, "d1").unwrap(), [2, 1]), (tracks(&run, "d1").unwrap(), [1, 1])] {
        let reader = SerializedFileReader::new(bytes::Bytes::from(table.bytes().unwrap())).unwrap();
        let found: Vec<i64> = reader.metadata().row_groups().iter().map(|group| group.num_rows()).collect();
        assert_eq!(found, rows);
    }
}

#[test]
fn tracks_have_the_times_of_their_frames() {
    let (folder, run) = run();
    let path = folder.path().join("tracks.parquet");
    fs::write(&path, tracks(&run, "d1").unwrap().bytes().unwrap()).unwrap();
    let rows = read_rows(&path).unwrap();
    let row = |name: &str| rows[0][name].as_str();
    assert_eq!((row("timestamp_ns"), row("id"), row("z_m")), ("700000000", "3", "20.123456"));
    assert_eq!((row("source"), rows[1]["source"].as_str()), ("box", "predicted"));
}

#[test]
fn errors_name_the_file() {
    let cases = [
        ("frames.csv", ",tracked,120,", ",tracked,many,", "frames.csv:2"),
        ("frames.csv", ",8.250000", ",inf", "frames.csv:4"),
        ("frames.csv", ",2.5,\n", ",2.5\n", "frames.csv:4"),
        ("frames.csv", "frame,", "number,", "row of `frame`"),
        ("ego.tum", "0.7 0 0 1.6 0 0 0 1\n", "", "ego.tum: has 2 poses, expected 3"),
        ("ego.tum", "0.7 ", "noon ", "ego.tum:2"),
        ("tracks.csv", "7,0.700000,3", "8,0.700000,3", "tracks.csv: has a vehicle in frame 8"),
    ];
    for (file, from, to, said) in cases {
        let (_folder, run) = run();
        let text = fs::read_to_string(run.join(file)).unwrap();
        fs::write(run.join(file), text.replacen(from, to, 1)).unwrap();
        let error = frames(&run, "d").and(tracks(&run, "d")).map(drop).unwrap_err();
        assert!(error.to_string().contains(said) && error.exit_code() == 3, "{error}");
    }
}
