//! Errors name their cause, exit codes are the documented ones, and no partial output remains.

use std::fs;

use crate::common::{answer, drive, frame_file, nothing_written, program, run};

#[test]
fn an_empty_folder() {
    let folder = drive(1);
    fs::create_dir(folder.path().join("empty")).unwrap();
    let arguments = "run empty --calibration camera.toml --height 1.5 --out out";
    answer(folder.path(), arguments).expect(3, &["empty"]);
    nothing_written(folder.path());
}

#[test]
fn an_input_that_is_not_there() {
    let folder = drive(1);
    answer(folder.path(), "run nowhere --height 1.5 --out out").expect(3, &["nowhere"]);
    answer(folder.path(), "inspect nowhere").expect(3, &["nowhere"]);
    nothing_written(folder.path());
}

#[test]
fn a_calibration_of_another_size() {
    let folder = drive(3);
    let other = crate::common::CALIBRATION
        .replace("width = 480", "width = 640")
        .replace("height = 240", "height = 480");
    fs::write(folder.path().join("camera.toml"), other).unwrap();
    run(folder.path(), "").expect(3, &["camera.toml", "640x480", "480x240"]);
    nothing_written(folder.path());
}

#[test]
fn a_calibration_with_a_wrong_key_or_none() {
    let folder = drive(3);
    fs::write(folder.path().join("camera.toml"), "fx = 390.0\nfz = 390.0\n").unwrap();
    run(folder.path(), "").expect(3, &["camera.toml", "fz"]);
    let none = answer(folder.path(), "run frames --height 1.5 --out out");
    none.expect(none.code, &["--calibration"]);
    assert!([1, 3].contains(&none.code), "{}", none.code);
    nothing_written(folder.path());
}

#[test]
fn a_file_that_is_no_video() {
    let folder = drive(1);
    fs::write(folder.path().join("drive.mp4"), b"this is no video").unwrap();
    let arguments = "run drive.mp4 --calibration camera.toml --height 1.5 --out out";
    // 3 where ffmpeg is installed, 5 where it is not: both name what is at fault.
    let output = answer(folder.path(), arguments);
    if output.stderr.contains("install ffmpeg") {
        output.expect(5, &["ffprobe"]);
    } else {
        output.expect(3, &["drive.mp4"]);
    }
    nothing_written(folder.path());
}

#[test]
fn no_ffmpeg() {
    let folder = drive(1);
    fs::write(folder.path().join("drive.mp4"), b"this is no video").unwrap();
    let mut command =
        program(folder.path(), "run drive.mp4 --calibration camera.toml --height 1.5 --out out");
    let output: crate::common::Answer = command.env("PATH", folder.path()).output().unwrap().into();
    output.expect(5, &["ff", "install ffmpeg"]);
    nothing_written(folder.path());
}

#[test]
fn a_detection_with_a_wrong_column() {
    let folder = drive(3);
    fs::write(folder.path().join("boxes.csv"), "0,10,20,60,80,0.9\n1,10,twenty,60,80,0.9\n").unwrap();
    run(folder.path(), "--detections boxes.csv").expect(3, &["boxes.csv:2", "twenty"]);
    fs::write(folder.path().join("boxes.csv"), "0,10,20,60,80,0.9\n1,10,20,60\n").unwrap();
    run(folder.path(), "--detections boxes.csv").expect(3, &["boxes.csv:2"]);
    run(folder.path(), "--detections nothing.csv").expect(3, &["nothing.csv"]);
    nothing_written(folder.path());
}

#[cfg(target_os = "linux")]
#[test]
fn boxes_beyond_number_in_a_frame_take_no_second() {
    let folder = drive(3);
    for count in [80_000, 1_000_000] {
        fs::write(folder.path().join("boxes.csv"), "1,10,20,60,80,0.9\n".repeat(count)).unwrap();
        let usual = "run frames --calibration camera.toml --height 1.5 --out out --detections boxes.csv";
        let cost = crate::common::cost::cost(folder.path(), usual);
        cost.at_most_a_second().expect(3, &["boxes.csv:1001", "1000 objects"]);
        assert!(cost.peak_kb < 200 << 10, "{count}: {} kB", cost.peak_kb);
    }
    nothing_written(folder.path());
}

#[test]
fn speeds_and_tracks_that_do_not_fit() {
    let folder = drive(3);
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("speed.csv", "time,speed_kmh\n0,36\n1,fast\n");
    run(folder.path(), "--speed speed.csv").expect(3, &["speed.csv:3", "fast"]);
    write("speed.csv", "time,speed_kmh\n1000,36\n1001,36\n1002,36\n");
    run(folder.path(), "--speed speed.csv").expect(3, &["no time in common", "--clock-offset"]);
    write("track.csv", "time,latitude,longitude\n0,49,8\n1,49,8\n");
    run(folder.path(), "--gps track.csv").expect(3, &["track.csv", "no distance"]);
    run(folder.path(), "--gps track.csv --speed speed.csv").expect(1, &["--gps", "--speed"]);
    run(folder.path(), "--gps track.csv --online").expect(1, &["--gps", "--online"]);
    run(folder.path(), "--gps track.csv --clock-offset soon").expect(1, &["--clock-offset", "soon"]);
    run(folder.path(), "--clock-offset 1").expect(1, &["--clock-offset"]);
    write("speed.csv", "time,speed_kmh\n0,36\n1,36\n2,36\n");
    run(folder.path(), "--speed speed.csv --preset paper").expect(1, &["scale.smoothed"]);
    nothing_written(folder.path());
}

#[test]
fn an_unknown_setting_names_the_nearest() {
    let folder = drive(3);
    run(folder.path(), "--set road.far_hights=12").expect(1, &["far_hights", "`far_heights`"]);
    fs::write(folder.path().join("my.toml"), "[rode]\nfar_heights = 12\n").unwrap();
    run(folder.path(), "--config my.toml").expect(1, &["my.toml", "rode", "`road`"]);
    fs::write(folder.path().join("my.toml"), "[road\n").unwrap();
    run(folder.path(), "--config my.toml").expect(1, &["my.toml"]);
    nothing_written(folder.path());
}

#[test]
fn a_configuration_file_that_is_not_there() {
    let folder = drive(3);
    run(folder.path(), "--config nowhere.toml").expect(3, &["nowhere.toml"]);
    nothing_written(folder.path());
}

#[test]
fn heights_that_cannot_be() {
    let folder = drive(3);
    let start = "run frames --calibration camera.toml --out out";
    answer(folder.path(), start).expect(1, &["--height"]);
    for height in ["0", "-1.5", "NaN", "inf"] {
        answer(folder.path(), &format!("{start} --height={height}")).expect(1, &["height"]);
    }
    answer(folder.path(), &format!("{start} --height tall")).expect(1, &["tall"]);
    nothing_written(folder.path());
}

#[test]
fn places_that_cannot_be_written() {
    let folder = drive(3);
    let start = "run frames --calibration camera.toml --height 1.5";
    fs::write(folder.path().join("file"), b"mine").unwrap();
    answer(folder.path(), &format!("{start} --out file")).expect(5, &["file"]);
    answer(folder.path(), &format!("{start} --out file/below")).expect(5, &["file"]);
    assert_eq!(fs::read(folder.path().join("file")).unwrap(), b"mine");
    nothing_written(folder.path());
}

#[test]
fn a_place_that_holds_something() {
    let folder = drive(3);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("thesis.tex"), b"mine").unwrap();
    run(folder.path(), "").expect(1, &["out", "not empty"]);
    // Not even by force: it is no run.
    run(folder.path(), "--force").expect(1, &["out", "run.json"]);
    assert_eq!(fs::read(out.join("thesis.tex")).unwrap(), b"mine");
    crate::common::no_leftovers(folder.path());
}

#[test]
fn networks_that_are_none() {
    let folder = drive(3);
    run(folder.path(), "--models nowhere").expect(3, &["nowhere"]);
    let models = folder.path().join("models");
    fs::create_dir(&models).unwrap();
    run(folder.path(), "--models models").expect(3, &["models"]);
    let manifest = "[[model]]\nfile = \"yolox_nano_416.onnx\"\n";
    fs::write(models.join("yolox_nano_416.onnx"), b"this is no network").unwrap();
    run(folder.path(), "--models models").expect(3, &["yolox_nano_416.onnx"]);
    fs::write(models.join("models.toml"), manifest).unwrap();
    run(folder.path(), "--models models").expect(3, &["models.toml"]);
    nothing_written(folder.path());
}

#[test]
fn every_frame_unreadable() {
    let folder = drive(4);
    for number in 0..4 {
        fs::write(frame_file(&folder.path().join("frames"), number), b"no image").unwrap();
    }
    run(folder.path(), "").expect(3, &["000000.png"]);
    nothing_written(folder.path());
}

#[test]
fn frames_out_of_range_and_strides_of_nothing() {
    let folder = drive(4);
    run(folder.path(), "--frames 100..200").expect(1, &["100"]);
    run(folder.path(), "--frames ten").expect(1, &["ten"]);
    run(folder.path(), "--stride 0").expect(1, &["stride"]);
    let threads = "run frames --calibration camera.toml --height 1.5 --out out --threads 100000";
    answer(folder.path(), threads).expect(1, &["100000", "1024"]);
    run(folder.path(), "--format tape").expect(1, &["tape", "images"]);
    run(folder.path(), "--hieght 2").expect(1, &["--hieght"]);
    nothing_written(folder.path());
}
