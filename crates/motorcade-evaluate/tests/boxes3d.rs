//! Average precision of 3D boxes against the independent script (`tools/ap3d.py` of `MOTORCADE_SHARED`).
//!
//! The script's numbers for a drive made here stand in this file and are compared always; the script itself runs where Python with
//! numpy and shapely and the script are there.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

mod common;

use std::path::Path;
use std::process::Command;

use motorcade_evaluate::{AveragePrecision, Boxes3dReport, evaluate_run};

use common::{FRAMES, make};

/// `ap3d.py` for this drive: 3D and from above at 0.5, 3D and from above at 0.7; easy, moderate, hard.
const BY_SCRIPT: [[f64; 3]; 4] =
    [[22.9, 35.5, 37.9], [22.9, 38.4, 38.7], [6.2, 7.4, 7.9], [10.9, 12.2, 12.6]];

fn rows(report: &Boxes3dReport) -> [[f64; 3]; 4] {
    let row = |ap: AveragePrecision| [ap.easy, ap.moderate, ap.hard];
    [row(report.ap3d_50), row(report.bev_50), row(report.ap3d_70), row(report.bev_70)]
}

#[test]
fn average_precision_agrees_with_the_script() {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path());
    let report = evaluate_run(&folder.path().join("run"), folder.path(), "0042", 2, 0).unwrap();
    let found = rows(report.boxes3d.as_ref().unwrap());
    println!("{found:?}");
    let agree = |other: &[[f64; 3]; 4], which: &str| {
        for (a, b) in found.iter().flatten().zip(other.iter().flatten()) {
            assert!((a - b).abs() < 0.051, "{which}: {found:?} {other:?}");
        }
    };
    if let Some(by_script) = run_script(folder.path()) {
        agree(&by_script, "ap3d.py now");
    }
    agree(&BY_SCRIPT, "ap3d.py as noted");
    let text = report.to_string();
    assert!(text.contains("AP|R40") && text.contains("from above, IoU 0.7"), "{text}");
}

/// The script's table, when it and its Python packages are there.
fn run_script(root: &Path) -> Option<[[f64; 3]; 4]> {
    let shared = std::env::var("MOTORCADE_SHARED").unwrap_or_else(|_| "../../../shared".into());
    let script = Path::new(&shared).join("tools/ap3d.py");
    let results = root.join("run/tracks.kitti.txt");
    let argument = format!("0042:0:{}:{}", FRAMES - 1, results.display());
    let done = Command::new("python3").arg(&script).arg(root.join("label_02")).arg(argument).output().ok()?;
    if !done.status.success() {
        println!(
            "ap3d.py did not run: {}",
            String::from_utf8_lossy(&done.stderr).lines().last().unwrap_or("")
        );
        return None;
    }
    let text = String::from_utf8(done.stdout).unwrap();
    let line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        ["easy", "moderate", "hard"].map(|name| {
            let at = words.iter().position(|word| *word == name).unwrap();
            words[at + 1].parse().unwrap()
        })
    };
    let lines: Vec<[f64; 3]> = text.lines().map(line).collect();
    lines.try_into().ok()
}
