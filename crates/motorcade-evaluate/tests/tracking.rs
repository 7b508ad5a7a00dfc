//! 3D tracking metrics against AB3DMOT's evaluator, 2D ones against TrackEval.
//!
//! The numbers of both for a drive made here stand in this file. AB3DMOT's evaluator is in no package index: its numbers are those of the counting and
//! averaging of its `scripts/KITTI/evaluate.py`, with SciPy's assignment, run once outside this repository. TrackEval 1.3.0 is run on a rendered drive by
//! `scripts/check_clients.sh` too.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

mod common;

use std::path::Path;

use motorcade_dataset::read_labels;
use motorcade_evaluate::{Report, evaluate_run};

use common::make;

/// Of each overlap: sAMOTA, AMOTA, AMOTP, MOTA, MOTP, recall [%], switches, fragmentations.
const BY_AB3DMOT: [[f64; 8]; 2] = [
    [70.135, 33.667, 50.549, 66.0, 60.886, 83.784, 1.0, 2.0],
    [10.336, 1.683, 47.381, 12.667, 69.916, 66.497, 1.0, 1.0],
];
/// HOTA, DetA, AssA, LocA, MOTA, recall [%], switches, fragmentations.
const BY_TRACKEVAL: [f64; 8] = [64.099, 67.171, 61.338, 92.212, 60.0, 80.0, 16.0, 38.0];

/// The run of [`make`] with tracks that break: one goes on under another identity, two exchange theirs for a time, one is missed for some frames, and
/// what is seen of one is another track in every fifth frame.
fn make_broken(root: &Path) {
    make(root);
    let path = root.join("run/tracks.kitti.txt");
    let mut lines = String::new();
    for mut label in read_labels(&path).unwrap() {
        label.track = match (label.track, label.frame) {
            (4, 20..) => 14,
            (0, 10..15) => 1,
            (1, 10..15) => 0,
            (5, frame) if frame % 5 == 0 => 15,
            (track, _) => track,
        };
        if label.track != 3 || !(12..18).contains(&label.frame) {
            lines += &(label.to_line() + "\n");
        }
    }
    std::fs::write(path, lines).unwrap();
}

fn broken() -> Report {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    make_broken(root);
    evaluate_run(&root.join("run"), root, "0042", 2, 0).unwrap()
}

/// To the third digit.
fn assert_equal(found: &[f64], expected: &[f64]) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < 6e-4, "{found:?}, expected {expected:?}");
    }
}

#[test]
fn tracking_in_3d_agrees_with_the_evaluator_of_ab3dmot() {
    let report = broken().tracking3d.unwrap();
    for (of, expected) in [report.iou_25, report.iou_50].iter().zip(&BY_AB3DMOT) {
        let counts = [of.id_switches as f64, of.fragmentations as f64];
        let found = [of.samota, of.amota, of.amotp, of.mota, of.motp, of.recall, counts[0], counts[1]];
        assert_equal(&found, expected);
    }
}

#[test]
fn tracking_in_2d_agrees_with_trackeval() {
    let report = broken();
    let of = report.tracking2d.unwrap();
    let counts = [of.id_switches as f64, of.fragmentations as f64];
    assert_equal(
        &[of.hota, of.det_a, of.ass_a, of.loc_a, of.mota, of.recall, counts[0], counts[1]],
        &BY_TRACKEVAL,
    );
    let text = report.to_string();
    assert!(text.contains("sAMOTA") && text.contains("HOTA"), "{text}");
}
