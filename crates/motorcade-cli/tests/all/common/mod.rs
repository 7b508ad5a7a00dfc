//! A tiny drive made on the spot, and the program to run on it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail loudly too")]

#[cfg(target_os = "linux")]
pub mod cost;
#[cfg(unix)]
pub mod places;

use std::path::{Path, PathBuf};
use std::process::Output;

use image::GrayImage;
use tempfile::TempDir;

pub use motorcade_testing::street_image::CAMERA;
use motorcade_testing::street_image::{StreetPose, street_image};

/// Way between two frames.
pub const STEP_M: f64 = 1.0;

/// Calibration of the drive in our own format.
pub const CALIBRATION: &str =
    "fx = 390.0\nfy = 390.0\ncx = 240.0\ncy = 105.0\nwidth = 480\nheight = 240\nfps = 10.0\n";

/// Image of a street between two walls, from `way_m` along it.
pub fn street(way_m: f64) -> GrayImage {
    street_image(&CAMERA, &StreetPose::along(way_m))
}

/// Name of a frame's file.
pub fn frame_file(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("{number:06}.png"))
}

/// A folder with `frames/` and `camera.toml`.
pub fn drive(frames: u64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("frames");
    std::fs::create_dir(&images).unwrap();
    for number in 0..frames {
        street(number as f64 * STEP_M).save(frame_file(&images, number)).unwrap();
    }
    std::fs::write(folder.path().join("camera.toml"), CALIBRATION).unwrap();
    folder
}

/// Output of the program.
pub struct Answer {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Answer {
    /// Fails unless the program ended with this code and said all of these on stderr.
    #[track_caller]
    pub fn expect(&self, code: i32, said: &[&str]) -> &Self {
        assert_eq!(self.code, code, "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        for part in said {
            assert!(self.stderr.contains(part), "no `{part}` in:\n{}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }
}

impl From<Output> for Answer {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// The program in a folder, with arguments separated by spaces.
pub fn program(folder: &Path, arguments: &str) -> assert_cmd::Command {
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_motorcade"));
    // Most tests need no vehicles; a test of the networks inside the program asks for them.
    command.current_dir(folder).env("MOTORCADE_MODELS", "none").env_remove("MOTORCADE_LOG");
    command.args(arguments.split_whitespace()).timeout(std::time::Duration::from_secs(120));
    command
}

/// Runs it.
pub fn answer(folder: &Path, arguments: &str) -> Answer {
    program(folder, arguments).output().unwrap().into()
}

/// The usual run on [`drive`], with more arguments.
pub fn run(folder: &Path, more: &str) -> Answer {
    let usual = "run frames --calibration camera.toml --height 1.5 --out out --threads 1";
    answer(folder, &format!("{usual} {more}"))
}

/// Fails when a run left anything: results, or the folder it writes them in.
#[track_caller]
pub fn nothing_written(folder: &Path) {
    assert!(!folder.join("out").exists());
    no_leftovers(folder);
}

/// Fails when a folder the program works in was left behind.
#[track_caller]
pub fn no_leftovers(folder: &Path) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name();
        assert!(!name.to_string_lossy().starts_with(".motorcade"), "{name:?} was left");
    }
}

/// A JSON file.
pub fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of a CSV file without its head, cells split.
pub fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// A file's text without the pictures of a report: their letters may spell anything.
#[allow(dead_code, reason = "not every test uses it")]
pub fn without_pictures(text: &str) -> String {
    match text.split_once("\"jpeg\":[") {
        Some((before, after)) => format!("{before}{}", after.split_once(']').map_or("", |(_, rest)| rest)),
        None => text.to_owned(),
    }
}
