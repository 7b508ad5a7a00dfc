//! ONNX Runtime against `rten`, where the library (`ORT_DYLIB_PATH`) and the development data (`MOTORCADE_SHARED`) are.

#![cfg(feature = "ort")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use motorcade_dataset::{Frame, Sequence, SequenceOptions};
use motorcade_perception::{Engine, ModelOptions, ModelSource, Observations, Perception, PerceptionOptions};
use motorcade_testing::shared;

const KITTI: (u32, u32) = (1242, 375);
/// Runs a time is the best of: other programs may run beside the test.
const REPEATS: usize = 5;

/// The development data, when there is anything to compare.
fn development_data() -> Option<PathBuf> {
    if std::env::var_os("ORT_DYLIB_PATH").is_none() {
        println!("skipped: set ORT_DYLIB_PATH");
        return None;
    }
    shared("models").and(shared("."))
}

fn perception(shared: &Path, engine: Engine, threads: usize) -> Perception {
    let networks = ModelOptions { threads, engine, ..ModelOptions::default() };
    let models = ModelSource::Folder(shared.join("models"));
    Perception::open(&PerceptionOptions { models, networks, ..PerceptionOptions::default() }, KITTI).unwrap()
}

fn frame(shared: &Path) -> Frame {
    let options =
        SequenceOptions { sequence: Some("0005".into()), camera: Some(3), ..SequenceOptions::default() };
    let drive = Sequence::open(&shared.join("kitti/tracking/training"), &options).unwrap();
    drive.frames().nth(150).unwrap().unwrap()
}

/// Observations, and the shortest time they took \[s\].
fn timed(perception: &mut Perception, frame: &Frame) -> (Observations, f64) {
    let percepts = perception.observe(frame).unwrap();
    let once = |_| {
        let started = Instant::now();
        perception.observe(frame).unwrap();
        started.elapsed().as_secs_f64()
    };
    (percepts, (0..REPEATS).map(once).fold(f64::INFINITY, f64::min))
}

#[test]
fn both_engines_see_the_same() {
    let Some(shared) = development_data() else { return };
    let frame = frame(&shared);
    let (ours, ours_s) = timed(&mut perception(&shared, Engine::Rten, 1), &frame);
    let mut other = perception(&shared, Engine::OnnxRuntime, 1);
    assert_eq!(other.describe().0, "network yolox-nano-1248 by ONNX Runtime");
    let (theirs, theirs_s) = timed(&mut other, &frame);
    assert!(!ours.detections.is_empty());
    assert_eq!(ours.detections.len(), theirs.detections.len());
    let (mut furthest_px, mut score) = (0.0_f64, 0.0_f64);
    for (a, b) in ours.detections.iter().zip(&theirs.detections) {
        assert_eq!(a.class, b.class);
        let (p, q) = (&a.bbox, &b.bbox);
        for edge in [p.x1 - q.x1, p.y1 - q.y1, p.x2 - q.x2, p.y2 - q.y2] {
            furthest_px = furthest_px.max(edge.abs());
        }
        score = score.max((a.score - b.score).abs());
    }
    println!(
        "{} vehicles, edges within {furthest_px:.1e} px, scores within {score:.1e}; both networks on one thread: rten \
         {:.0} ms, ONNX Runtime {:.0} ms, ratio {:.2}",
        ours.detections.len(),
        1e3 * ours_s,
        1e3 * theirs_s,
        ours_s / theirs_s
    );
    assert!(furthest_px <= 0.5 && score <= 0.01, "{furthest_px} px, score {score}");
}

#[test]
fn onnx_runtime_repeats_itself_on_any_number_of_threads() {
    let Some(shared) = development_data() else { return };
    let frame = frame(&shared);
    let one = perception(&shared, Engine::OnnxRuntime, 1).observe(&frame).unwrap();
    assert_eq!(one, perception(&shared, Engine::OnnxRuntime, 1).observe(&frame).unwrap());
    assert_eq!(one, perception(&shared, Engine::OnnxRuntime, 2).observe(&frame).unwrap());
}
