//! `motorcade run` and `motorcade inspect` on a street made on the spot.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test and its helpers")]

use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::Vector3;

use crate::common::{
    Answer, CAMERA, STEP_M, answer, drive, frame_file, json, no_leftovers, program, rows, run, street,
    without_pictures,
};

#[test]
fn a_folder_of_frames_becomes_a_metric_trajectory() {
    let folder = drive(24);
    let answer = run(folder.path(), "");
    answer.expect(0, &["no vehicles were looked for"]);
    let out = folder.path().join("out");
    let record = json(&out.join("run.json"));
    assert_eq!(record["counters"]["frames"], 24);
    assert_eq!(record["vehicles_looked_for"], false);
    // Metres, from nothing but pixels and the height of the camera.
    let table = rows(&out.join("frames.csv"));
    let speeds: Vec<f64> =
        table.iter().skip(4).filter(|row| row[2] == "tracked").map(|row| row[4].parse().unwrap()).collect();
    assert!(speeds.len() >= 18, "{} frames tracked", speeds.len());
    assert!(speeds.iter().all(|v| (v / (10.0 * STEP_M) - 1.0).abs() < 0.1), "{speeds:?} m/s");
    for (file, lines) in
        [("ego.tum", 24), ("ego.kitti.txt", 24), ("frames.csv", 25), ("speeds.csv", 25), ("tracks.csv", 1)]
    {
        assert_eq!(fs::read_to_string(out.join(file)).unwrap().lines().count(), lines, "{file}");
    }
    let page = without_pictures(&fs::read_to_string(out.join("report.html")).unwrap());
    assert!(page.contains("No vehicles were looked for") && page.ends_with("</html>\n"));
    // Nothing on the page is fetched from anywhere.
    assert!(!page.contains("src=") && !page.contains("http://") && !page.contains("https://"));
    assert!(!page.contains("NaN") && !page.contains("inf,"));
    no_leftovers(folder.path());
}

#[test]
fn threads_change_nothing() {
    let folder = drive(20);
    run(folder.path(), "--progress none").expect(0, &[]);
    run(folder.path(), "--progress none --out two --threads 2").expect(1, &["--out"]);
    let two = "run frames --calibration camera.toml --height 1.5 --out two --threads 2 --progress none";
    answer(folder.path(), two).expect(0, &[]);
    let read = |run: &str| fs::read(folder.path().join(run).join("ego.tum")).unwrap();
    assert_eq!(read("out"), read("two"));
}

#[test]
fn a_height_scales_the_drive() {
    let folder = drive(20);
    run(folder.path(), "--progress none").expect(0, &[]);
    let high = "run frames --calibration camera.toml --height 3.0 --out high --progress none";
    answer(folder.path(), high).expect(0, &[]);
    let length = |run: &str| json(&folder.path().join(run).join("run.json"))["length_m"].as_f64().unwrap();
    assert!((length("high") / length("out") - 2.0).abs() < 1e-6);
}

#[test]
fn an_online_run_prints_every_frame_as_it_comes() {
    let folder = drive(24);
    fs::remove_file(frame_file(&folder.path().join("frames"), 15)).unwrap();
    let output = run(folder.path(), "--online --progress none");
    output.expect(0, &[]);
    let lines: Vec<serde_json::Value> =
        output.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 24);
    for (number, line) in lines.iter().enumerate() {
        assert_eq!(line["frame"], number);
    }
    assert_eq!(lines[15]["status"], "bridged");
    let speed = lines[23]["camera"]["speed_mps"].as_f64().unwrap();
    assert!((speed - 10.0 * STEP_M).abs() < 1.0, "{speed} m/s");
    // The directory holds what was printed.
    let poses = fs::read_to_string(folder.path().join("out/ego.tum")).unwrap();
    let last: Vec<f64> = poses.lines().last().unwrap().split(' ').map(|v| v.parse().unwrap()).collect();
    let place = lines[23]["camera"]["position_m"].as_array().unwrap();
    assert!((0..3).all(|k| (last[1 + k] - place[k].as_f64().unwrap()).abs() < 1e-5), "{last:?} {place:?}");
    let record = json(&folder.path().join("out/run.json"));
    assert_eq!(record["configuration"]["online"]["enabled"], true);
}

#[test]
fn a_missing_number_is_bridged() {
    let folder = drive(24);
    fs::remove_file(frame_file(&folder.path().join("frames"), 12)).unwrap();
    let output = run(folder.path(), "");
    output.expect(0, &["frame 12", "is missing"]);
    assert_eq!(output.stderr.matches("frame 12").count(), 1, "{}", output.stderr);
    let table = rows(&folder.path().join("out/frames.csv"));
    assert_eq!(table.len(), 24);
    assert_eq!((table[12][0].as_str(), table[12][2].as_str()), ("12", "bridged"));
    assert_eq!(table[13][2], "tracked");
    // The bridge has the camera go on, not stand.
    let speed: f64 = table[12][4].parse().unwrap();
    assert!((speed - 10.0 * STEP_M).abs() < 2.0, "{speed} m/s");
}

#[test]
fn frames_that_do_not_read_are_bridged_and_reported() {
    let folder = drive(28);
    let frames = folder.path().join("frames");
    let bytes = fs::read(frame_file(&frames, 12)).unwrap();
    fs::write(frame_file(&frames, 12), &bytes[..bytes.len() / 3]).unwrap();
    image::imageops::crop_imm(&street(11.0), 0, 0, 200, 100)
        .to_image()
        .save(frame_file(&frames, 20))
        .unwrap();
    run(folder.path(), "").expect(0, &["000012.png", "truncated", "000020.png", "200x100"]);
    let table = rows(&folder.path().join("out/frames.csv"));
    assert_eq!((table[12][2].as_str(), table[20][2].as_str()), ("bridged", "bridged"));
    let record = json(&folder.path().join("out/run.json"));
    let broken: Vec<_> =
        record["unreadable_frames"].as_array().unwrap().iter().map(|f| &f["frame"]).collect();
    assert_eq!(broken, [12, 20]);
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("unreadable, bridged (2)"));
}

#[test]
fn too_many_lost_frames_end_with_4_and_results() {
    let folder = drive(12);
    for number in 5..10 {
        fs::write(frame_file(&folder.path().join("frames"), number), b"no image").unwrap();
    }
    run(folder.path(), "").expect(4, &["000005.png"]);
    assert_eq!(rows(&folder.path().join("out/frames.csv")).len(), 12);
}

#[test]
fn detections_give_vehicles_and_their_ids_stay() {
    let folder = drive(24);
    let line = |frame: u64| {
        // A car that keeps 12 m ahead on the left, 1.6 m wide and 1.5 m high.
        let px = CAMERA.fx / 12.0;
        let (x1, x2, y) = (CAMERA.cx - 2.8 * px, CAMERA.cx - 1.2 * px, CAMERA.cy);
        format!("{frame},{x1},{y},{x2},{},0.9\n", y + 1.5 * px)
    };
    fs::write(folder.path().join("boxes.csv"), (0..24).map(line).collect::<String>()).unwrap();
    run(folder.path(), "--detections boxes.csv").expect(0, &[]);
    let record = json(&folder.path().join("out/run.json"));
    assert_eq!(record["counters"]["vehicles"], 1, "{record:#}");
    assert_eq!(record["counters"]["detections"], 24);
    let table = rows(&folder.path().join("out/tracks.csv"));
    assert_eq!(table.len(), 24);
    assert!(table.iter().all(|row| row[2] == table[0][2]));
    // It moves with the camera: 10 m/s.
    let speed: f64 = table[12][14].parse().unwrap();
    assert!((speed - 10.0 * STEP_M).abs() < 1.0, "{speed} m/s");
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains(&format!("data-vehicle=\"{}\"", table[0][2])) && page.contains("vehicle moving"));
}

#[test]
fn a_finished_run_is_not_repeated() {
    let folder = drive(20);
    run(folder.path(), "").expect(0, &[]);
    let before = fs::metadata(folder.path().join("out/run.json")).unwrap().modified().unwrap();
    let again = run(folder.path(), "");
    again.expect(0, &[]);
    assert!(again.stdout.contains("already holds this run"), "{}", again.stdout);
    let after = fs::metadata(folder.path().join("out/run.json")).unwrap().modified().unwrap();
    assert_eq!(before, after);
    // Other settings are another run: they do not overwrite unasked.
    run(folder.path(), "--set road.far_heights=12").expect(1, &["out", "--force"]);
    run(folder.path(), "--set road.far_heights=12 --force").expect(0, &[]);
    no_leftovers(folder.path());
}

#[test]
fn inspect_prints_gaps_and_size() {
    let folder = drive(6);
    fs::remove_file(frame_file(&folder.path().join("frames"), 3)).unwrap();
    let table = answer(folder.path(), "inspect frames --calibration camera.toml");
    table.expect(0, &[]);
    for part in
        ["images", "480x240", "gaps         3", "fx 390.00", "aspect       2.000", "rotation     none"]
    {
        assert!(table.stdout.contains(part), "no `{part}` in:\n{}", table.stdout);
    }
    let machine = answer(folder.path(), "inspect frames --json");
    let summary: serde_json::Value = serde_json::from_str(&machine.expect(0, &[]).stdout).unwrap();
    assert_eq!((summary["frames"].as_u64(), summary["gaps"][0].as_u64()), (Some(6), Some(3)));
    assert!(summary["rotation_deg"].is_null(), "{summary}");
}

#[test]
fn inspect_prints_the_rate_and_how_much_it_varies() {
    let folder = drive(6);
    let rate = |arguments: &str| {
        let table = answer(folder.path(), &format!("inspect {arguments}"));
        let line = table.expect(0, &[]).stdout.lines().find_map(|line| line.strip_prefix("rate ")).unwrap();
        line.trim().to_owned()
    };
    assert_eq!(rate("frames --calibration camera.toml"), "10.000 frames/s");
    assert_eq!(rate("frames --fps 12.5"), "12.500 frames/s");
    assert_eq!(rate("frames"), "10.000 frames/s, assumed: give --fps");
    // Names that are times: one frame late by no whole number of intervals, which would be a gap; jitter of 10 ms; and of 1 ms,
    // which may be rounding.
    for (name, times_ms, expected) in [
        (
            "late",
            [0, 100, 200, 470, 570, 670],
            "10.000 frames/s in the middle, intervals from 0.100 to 0.270 s",
        ),
        (
            "jitter",
            [0, 110, 200, 300, 410, 500],
            "10.000 frames/s in the middle, intervals from 0.090 to 0.110 s",
        ),
        ("even", [0, 101, 201, 301, 401, 501], "10.000 frames/s"),
    ] {
        let timed = folder.path().join(name);
        fs::create_dir(&timed).unwrap();
        for (number, time_ms) in times_ms.into_iter().enumerate() {
            let time_ns = 1_403_636_579_000_000_000_u64 + time_ms * 1_000_000;
            let from = frame_file(&folder.path().join("frames"), number as u64);
            fs::copy(from, timed.join(format!("{time_ns}.png"))).unwrap();
        }
        assert_eq!(rate(name), expected);
    }
}

#[test]
fn inspect_counts_pictures_that_repeat_the_one_before() {
    let folder = drive(16);
    let frames = folder.path().join("frames");
    answer(folder.path(), "inspect frames --fps 20").expect(0, &[]);
    let looked = |arguments: &str| -> serde_json::Value {
        let output = answer(folder.path(), &format!("inspect frames --fps 20 --json {arguments}"));
        serde_json::from_str(&output.expect(0, &[]).stdout).unwrap()
    };
    assert_eq!(looked("")["pictures"], serde_json::json!({ "looked_at": 16, "repeated": 0, "frozen": 0 }));
    for k in (1..16).step_by(2) {
        fs::copy(frame_file(&frames, k - 1), frame_file(&frames, k)).unwrap();
    }
    let repeated = looked("")["pictures"]["repeated"].as_u64().unwrap();
    // The usual difference of two pictures is known from the second new one on.
    assert!((6..=8).contains(&repeated), "{repeated}");
    assert_eq!(looked("--compare 0")["pictures"]["looked_at"], 0);
    let table = answer(folder.path(), "inspect frames --fps 20");
    assert!(table.stdout.contains(&format!("{repeated} of the first 16 pictures")), "{}", table.stdout);
}

#[test]
fn progress_can_be_read_by_programs() {
    let folder = drive(20);
    let output = run(folder.path(), "--progress json");
    output.expect(0, &[]);
    let lines: Vec<serde_json::Value> =
        output.stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines.iter().any(|l| l["stage"] == "odometry" && l["done"] == 20));
    assert!(lines.iter().any(|l| l["warning"].is_string()));
}

/// Positions of a camera out of a KITTI pose file \[m\].
fn positions_m(path: &Path) -> Vec<Vector3<f64>> {
    let text = fs::read_to_string(path).unwrap();
    let row = |line: &str| -> Vec<f64> { line.split_whitespace().map(|n| n.parse().unwrap()).collect() };
    text.lines().map(row).map(|p| Vector3::new(p[3], p[7], p[11])).collect()
}

/// Ten pictures a second in a video of thirty, and shown for 0.1 to 0.3 s each: the speed is that of the pictures, from the first frame on.
#[test]
fn pictures_that_repeat_or_last_longer_leave_speeds_and_length_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    answer(folder, "simulate --scenario demo --frames 40 --width 400 --out drive --progress none")
        .expect(0, &[]);
    let text = fs::read_to_string(folder.join("drive/training/calib/0000.txt")).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix("P2:")).unwrap();
    let p: Vec<f64> = line.split_whitespace().map(|n| n.parse().unwrap()).collect();
    let camera = format!("fx = {}\nfy = {}\ncx = {}\ncy = {}\n", p[0], p[5], p[2], p[6]);
    fs::write(folder.join("camera.toml"), camera).unwrap();
    let mut drives = Vec::new();
    let positions = positions_m(&folder.join("drive/training/gt_poses/0000.txt"));
    let some = r",select='not(eq(mod(n\,7)\,2)+eq(mod(n\,7)\,4)+eq(mod(n\,7)\,5))'";
    // The uneven one ends a picture earlier.
    for (name, rate, said, last) in [
        ("ten", "", "", 39),
        ("thirty", ",fps=30", "frames repeat the frame before", 39),
        ("uneven", some, "", 38),
    ] {
        let encoded = Command::new("ffmpeg")
            .args(["-v", "error", "-framerate", "10", "-i", "drive/training/image_02/0000/%06d.png"])
            .args(["-vf", &format!("crop=trunc(iw/2)*2:trunc(ih/2)*2{rate}"), "-crf", "23"])
            .args(["-c:v", "libx264", "-pix_fmt", "yuv420p", "-vsync", "vfr", &format!("{name}.mp4")])
            .current_dir(folder)
            .status();
        assert!(encoded.unwrap().success());
        let command =
            format!("run {name}.mp4 --calibration camera.toml --height 1.65 --out {name} --progress none");
        let output = program(folder, &command).env("MOTORCADE_MODELS", "none").output().unwrap();
        Answer::from(output).expect(0, &[said]);
        let frames = rows(&folder.join(format!("{name}/frames.csv")));
        let speeds: Vec<f64> = frames.iter().map(|row| row[4].parse().unwrap()).collect();
        let length_m = json(&folder.join(format!("{name}/run.json")))["length_m"].as_f64().unwrap();
        let slowest = speeds[1..].iter().copied().fold(f64::INFINITY, f64::min);
        let way_m: f64 = positions[..=last].windows(2).map(|p| (p[1] - p[0]).norm()).sum();
        drives.push((slowest, speeds.into_iter().fold(0.0, f64::max), length_m / way_m, frames.len()));
    }
    let [(slowest, largest, scale, 40), (_, _, _, 118..), (_, _, _, 23)] = drives[..] else {
        panic!("{drives:?}")
    };
    assert!((scale - 1.0).abs() < 0.06 && slowest > 6.0, "{drives:?}");
    assert!(drives.iter().all(|d| d.1 < 1.3 * largest && (d.2 / scale - 1.0).abs() < 0.06), "{drives:?}");
    // In a video of thirty most frames have no step of their own.
    assert!(drives[2].0 > 0.75 * slowest, "{drives:?}");
}
