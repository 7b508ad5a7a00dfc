//! A circle driven twice, with odometry that drifts.

use super::OnlineLoops;
use crate::circle::{CAMERA, ROUND, Scene, scene};
use crate::record::{FrontEndView, known_places};
use crate::revision::Revision;
use crate::settings::Settings;

fn settings(threads: usize) -> Settings {
    let mut settings = Settings::new(CAMERA, 1.65);
    settings.config.online.enabled = true;
    settings.threads = threads;
    settings
}

fn drive(scene: &Scene, settings: &Settings) -> (OnlineLoops, Vec<Revision>) {
    let mut loops = OnlineLoops::new(settings).unwrap();
    let mut revisions = Vec::new();
    for rows in 1..=scene.frames.len() {
        let view = FrontEndView {
            frames: &scene.frames[..rows],
            detections: &[],
            keypoints: &Default::default(),
            motion: &scene.motion,
            road_measurements: &[],
            places: known_places(&scene.places, rows),
        };
        revisions.extend(loops.advance(&view, &scene.ego[rows - 1], settings));
    }
    (loops, revisions)
}

#[test]
fn a_loop_corrects_the_estimates_from_then_on() {
    let scene = scene(ROUND + 90, true);
    let (loops, revisions) = drive(&scene, &settings(1));
    assert!(revisions.len() >= 2 && loops.loops.closed().count() >= 8, "{:?}", loops.loops);
    let error = |row: usize, told: bool| {
        let mut frame = scene.ego[row].clone();
        if told {
            loops.offsets.camera(row, &mut frame);
        }
        (frame.world_from_camera.translation() - scene.truth[row].translation()).norm()
    };
    let (first, last) = (revisions[0].frame.number as usize, scene.ego.len() - 1);
    // Frames before the first correction stay as they were told.
    assert_eq!(error(first - 1, true), error(first - 1, false));
    assert!(
        error(last, false) > 1.5 && error(last, true) < 0.5,
        "{} {}",
        error(last, false),
        error(last, true)
    );
    let line: serde_json::Value = serde_json::from_str(&revisions[1].to_json()).unwrap();
    assert_eq!(
        (line["revision"].as_u64(), line["frame"].as_u64()),
        (Some(2), Some(revisions[1].frame.number))
    );
    // The way between the visits is corrected too.
    assert!(revisions[0].keyframes.len() > 30, "{}", revisions[0].keyframes.len());
}

#[test]
fn without_places_seen_again_nothing_is_corrected() {
    let scene = scene(ROUND + 60, false);
    let (loops, revisions) = drive(&scene, &settings(1));
    assert!(revisions.is_empty() && loops.loops.all.is_empty());
    let mut frame = scene.ego[100].clone();
    loops.offsets.camera(100, &mut frame);
    assert!(frame.world_from_camera == scene.ego[100].world_from_camera);
}

#[test]
fn threads_change_no_byte_of_a_correction() {
    let scene = scene(ROUND + 60, true);
    let lines = |threads: usize| -> Vec<String> {
        drive(&scene, &settings(threads)).1.iter().map(Revision::to_json).collect()
    };
    let one = lines(1);
    assert!(!one.is_empty() && one == lines(3));
}
