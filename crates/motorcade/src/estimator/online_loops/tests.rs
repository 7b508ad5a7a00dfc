//! A circle driven twice, or by a kept map, with odometry that drifts.

use std::ops::Range;
use std::sync::Arc;

use motorcade_geometry::{Pose, World};
use motorcade_graph::Stop;
use motorcade_odometry::{EgoFrame, EgoTrajectory, Rows};
use motorcade_places::PlaceMap;
use nalgebra::Vector6;

use super::OnlineLoops;
use crate::circle::{CAMERA, ROUND, Scene, scene};
use crate::finite;
use crate::kept_map::KeptMap;
use crate::record::{FrontEndView, known_places};
use crate::relative::add_camera;
use crate::revision::Revision;
use crate::settings::Settings;
use crate::test_results::vehicle;

fn settings(threads: usize) -> Settings {
    let mut settings = Settings::new(CAMERA, 1.65);
    settings.config.online.enabled = true;
    settings.threads = threads;
    settings
}

fn drive(scene: &Scene, settings: &Settings) -> (OnlineLoops, Vec<Revision>) {
    let mut loops = OnlineLoops::new(settings).unwrap();
    let revisions = drive_on(&mut loops, scene, 0..scene.frames.len(), settings);
    (loops, revisions)
}

/// Takes some rows.
fn drive_on(
    loops: &mut OnlineLoops,
    scene: &Scene,
    rows: Range<usize>,
    settings: &Settings,
) -> Vec<Revision> {
    let mut revisions = Vec::new();
    for rows in rows.start + 1..=rows.end {
        let view = FrontEndView {
            frames: &scene.frames[..rows],
            detections: &Rows::default(),
            keypoints: &Default::default(),
            motion: &scene.motion,
            road_measurements: &[],
            places: known_places(&scene.places, rows),
        };
        revisions.extend(loops.advance(&view, &scene.ego[rows - 1], settings));
    }
    revisions
}

/// The step to a keyframe is the whole way since the one before: its variances add up, and a row without a measured pose makes it unmeasured.
#[test]
fn steps_between_keyframes_are_those_of_all_rows_between() {
    let mut scene = scene(ROUND + 20, false);
    scene.ego[30].step_measured = false;
    let (loops, _) = drive(&scene, &settings(1));
    let rows: Vec<usize> = loops.search.keyframes().since(0).map(|k| k.frame).collect();
    assert!(rows.len() >= 4, "{rows:?}");
    for (k, ends) in rows.windows(2).enumerate() {
        let step = &loops.trajectory[k + 1];
        // No correlation of scale and turn lowers a variance of rotation along the way.
        let sum: f64 = (ends[0] + 1..=ends[1]).map(|row| scene.ego[row].step_covariance[(1, 1)]).sum();
        let found = step.step_covariance[(1, 1)];
        assert!((found / sum - 1.0).abs() < 0.1, "{ends:?}: {found} of {sum}");
        assert_eq!(step.step_measured, !(ends[0] + 1..=ends[1]).contains(&30), "{ends:?}");
    }
}

#[test]
fn a_loop_corrects_the_estimates_from_then_on() {
    let scene = scene(ROUND + 90, true);
    let (loops, revisions) = drive(&scene, &settings(1));
    assert!(revisions.len() >= 2 && loops.loops.closed().count() >= 8, "{:?}", loops.loops);
    let error = |row: usize, corrected: bool| {
        let offset = if corrected { loops.offsets.at(row) } else { Pose::identity() };
        let pose = offset * scene.ego[row].world_from_camera;
        (pose.translation() - scene.truth[row].translation()).norm()
    };
    let (first, last) = (revisions[0].frame.number as usize, scene.ego.len() - 1);
    // Frames before the first correction stay as they were returned.
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
fn after_a_loop_the_camera_is_as_certain_as_the_loop_makes_it() {
    let scene = scene(ROUND + 90, true);
    let (loops, revisions) = drive(&scene, &settings(1));
    let (first, last) = (revisions[0].frame.number as usize, scene.ego.len() - 1);
    let sigma_m = |frame: &EgoFrame| frame.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
    // A vehicle 0.2 m uncertain relative to the camera.
    let vehicle = |row: usize| {
        let mut one = vehicle(1, vec![finite::tests::state(0.04)]);
        one.states[0].frame = row;
        let ego = EgoTrajectory { frames: scene.ego.to_vec(), height_m: 1.65, noise: Vec::new() };
        one.states[0].world_from_vehicle = scene.ego[row].world_from_camera.cast();
        add_camera(&ego, std::slice::from_mut(&mut one));
        one.states.remove(0)
    };
    let (mut cameras, mut states) = (scene.ego.to_vec(), [vehicle(first - 1), vehicle(last)]);
    loops.offsets.all(&mut cameras, states.iter_mut());
    assert_eq!(sigma_m(&cameras[first - 1]), sigma_m(&scene.ego[first - 1]));
    let (own, moved) = (sigma_m(&scene.ego[last]), sigma_m(&cameras[last]));
    assert!(moved < 0.8 * own, "{moved} m of {own} m");
    for row in first..=last {
        let off = (cameras[row].world_from_camera.inverse() * scene.truth[row]).translation().norm();
        assert!(off < 4.0 * sigma_m(&cameras[row]), "row {row}: {off} m, {} m", sigma_m(&cameras[row]));
    }
    // As it was returned when its frame came.
    let (mut newest, mut state) = (scene.ego[last].clone(), vehicle(last));
    loops.offsets.newest(last, &mut newest, std::iter::once(&mut state));
    assert_eq!((newest.covariance, state.covariance), (cameras[last].covariance, states[1].covariance));
    for (row, state) in [(first - 1, &states[0]), (last, &states[1])] {
        let relative = state.covariance - cameras[row].covariance;
        assert!((relative.fixed_view::<3, 3>(3, 3).trace() - 0.12).abs() < 1e-6, "row {row}: {relative}");
    }
}

#[test]
fn without_places_seen_again_nothing_is_corrected() {
    let scene = scene(ROUND + 60, false);
    let (loops, revisions) = drive(&scene, &settings(1));
    assert!(revisions.is_empty() && loops.loops.all.is_empty());
    assert!(loops.offsets.at(100) == Pose::identity());
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

/// The places of a scene in a world moved by `there`, exact.
fn kept_map(scene: &Scene, there: &Pose<World, World>) -> KeptMap {
    let settings = settings(1);
    let mut map = drive(scene, &settings).0.finish(&settings, Stop::NEVER).0.map.unwrap();
    for keyframe in &mut map.keyframes {
        keyframe.world_from_camera = *there * scene.truth[keyframe.frame];
    }
    KeptMap { map: Arc::new(map), digest: String::new(), bytes: 0 }
}

#[test]
fn a_drive_is_in_the_world_of_a_kept_map_once_it_is_met() {
    let there = Pose::exp(&Vector6::new(0.0, 1.2, 0.0, 300.0, 2.0, -80.0));
    let map = kept_map(&scene(ROUND + 20, true), &there);
    let scene = scene(ROUND + 20, true);
    let mut settings = settings(1);
    settings.external.map = Some(map);
    let (loops, revisions) = drive(&scene, &settings);
    let first = &revisions[0];
    assert!(first.by_map.unwrap() >= 3 && first.closed == 0, "{first:?}");
    let line: serde_json::Value = serde_json::from_str(&first.to_json()).unwrap();
    assert_eq!(line["map"]["matches"].as_u64(), first.by_map.map(|n| n as u64));
    let returned = |row: usize| loops.offsets.at(row) * scene.ego[row].world_from_camera;
    let met = first.frame.number as usize;
    assert_eq!(loops.loops.kept.as_ref().unwrap().first_estimated_frame, Some(met));
    let moved_m =
        (returned(met - 1).translation() - scene.ego[met - 1].world_from_camera.translation()).norm();
    assert!(met < 20 && moved_m < 1e-9, "{met}: {moved_m} m before");
    for row in met..scene.truth.len() {
        let off = (returned(row).translation() - (there * scene.truth[row]).translation()).norm();
        assert!(off < 0.4, "row {row}: {off} m");
    }
    // Its own places are kept in that world too.
    let kept = loops.finish(&settings, Stop::NEVER).0;
    assert!(kept.in_world_of_map());
    let worst = kept.map.unwrap().keyframes.iter().fold(0.0_f64, |worst, k| {
        let right = there * scene.truth[k.frame];
        worst.max((k.world_from_camera.translation() - right.translation()).norm())
    });
    assert!(worst < 0.3, "{worst} m");
}

#[test]
fn a_kept_map_of_other_streets_is_not_met() {
    let other = kept_map(&scene(2 * ROUND - 30, false), &Pose::identity());
    let of_second = other.map.keyframes.iter().filter(|k| k.frame > ROUND + 20).cloned().collect();
    let map = PlaceMap { keyframes: of_second, ..(*other.map).clone() };
    let mut settings = settings(1);
    settings.external.map = Some(KeptMap { map: Arc::new(map), ..other });
    let (loops, revisions) = drive(&scene(ROUND + 20, true), &settings);
    // The drive closes loops of its own.
    assert!(revisions.iter().all(|r| r.by_map == Some(0) && r.closed > 0), "{revisions:?}");
    assert!(!loops.finish(&settings, Stop::NEVER).0.in_world_of_map());
}

#[test]
fn round_after_round_memory_holds_the_first_visits_alone() {
    let rounds = 9;
    let scene = scene(rounds * ROUND, true);
    let mut settings = settings(1);
    let online = &mut settings.config.online.advanced;
    (online.least_corrected_keyframes, online.overlap_keyframes) = (60, 10);
    let most_visits = online.most_visits;
    let (loops, revisions) = drive(&scene, &settings);
    let (settled, own) = (loops.settled.first, loops.own());
    assert!(settled >= 256, "{settled} of {own}");
    // Of the settled ones the first visits stay; some of the places were not known at the first look.
    let held = loops.search.keyframes().since(0).count();
    assert!(held < own - settled + (most_visits + 1) * ROUND / 3, "{held} of {own}, {settled} settled");
    assert!(loops.trajectory.kept().len() < own - settled + 1 && loops.judged.len() < own - settled);
    let newest = revisions.last().unwrap();
    assert!(newest.closed + newest.switched_off > (rounds - 2) * ROUND / 3, "{newest:?}");
    // The last ones before a correction seem false to an odometry that drifts one way.
    assert!(20 * newest.switched_off < newest.closed, "{newest:?}");
    // The last rounds are told as well as the third.
    let off_m = |row: usize| {
        let pose = loops.offsets.at(row) * scene.ego[row].world_from_camera;
        (pose.translation() - scene.truth[row].translation()).norm()
    };
    let worst_m = (2 * ROUND..rounds * ROUND).map(off_m).fold(0.0, f64::max);
    assert!(worst_m < 1.0, "{worst_m} m");
    let (found, lost) = loops.finish(&settings, Stop::NEVER);
    assert_eq!(lost, None);
    // All loops and places are there at the end, in their order.
    assert_eq!(found.closed().count(), newest.closed);
    assert!(found.all.windows(2).all(|l| l[0].edge.later < l[1].edge.later));
    let keyframes = found.map.unwrap().keyframes;
    assert!(keyframes.iter().map(|k| k.frame).eq((0..own).map(|k| 3 * k)));
    let with_landmarks = keyframes.iter().filter(|k| !k.landmarks.is_empty()).count();
    assert!(with_landmarks < (most_visits + 2) * ROUND / 3, "{with_landmarks}");
}

#[test]
fn matches_with_a_kept_map_come_back_at_the_end() {
    let map = kept_map(&scene(ROUND + 20, true), &Pose::identity());
    let mut settings = settings(1);
    settings.external.map = Some(map);
    settings.config.online.advanced.least_corrected_keyframes = 60;
    let scene = scene(6 * ROUND, true);
    let (loops, revisions) = drive(&scene, &settings);
    let (settled, by_map) = (loops.settled.first, revisions.last().unwrap().by_map.unwrap());
    assert!(settled > 0 && by_map > settled / 2, "{by_map} by the map, {settled} settled");
    let (found, lost) = loops.finish(&settings, Stop::NEVER);
    let matches = found.kept.unwrap().matches;
    assert_eq!((lost, matches.iter().filter(|m| m.holds).count()), (None, by_map));
    assert!(matches.windows(2).all(|m| m[0].edge.frame < m[1].edge.frame));
}

#[test]
fn places_that_do_not_read_back_are_a_warning() {
    let scene = scene(9 * ROUND, true);
    let mut settings = settings(1);
    settings.config.online.advanced.least_corrected_keyframes = 60;
    let (mut loops, _) = drive(&scene, &settings);
    assert!(loops.settled.first > 0);
    loops.settled.break_file();
    let (found, lost) = loops.finish(&settings, Stop::NEVER);
    assert!(lost.unwrap().contains("did not read back") && found.map.is_none());
}

#[test]
fn loops_go_on_from_a_state_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let mut settings = settings(1);
    settings.external.map = Some(kept_map(&scene(ROUND + 20, true), &Pose::identity()));
    let online = &mut settings.config.online.advanced;
    (online.least_corrected_keyframes, online.overlap_keyframes) = (60, 10);
    let scene = scene(5 * ROUND, true);
    let named = || {
        let mut loops = OnlineLoops::new(&settings).unwrap();
        loops.put_rows_in(folder.path());
        loops
    };
    // After the first loop, and once keyframes are settled.
    let stops = [ROUND + 50, 5 * ROUND - 60];
    let (mut whole, mut states, mut revisions) = (named(), Vec::new(), Vec::new());
    for rows in [0..stops[0], stops[0]..stops[1], stops[1]..scene.frames.len()] {
        revisions.extend(drive_on(&mut whole, &scene, rows, &settings));
        states.push(postcard::to_stdvec(&whole.state().unwrap()).unwrap());
    }
    assert!(whole.settled.first > 0);
    let lines = |revisions: &[Revision], from: usize| -> Vec<String> {
        let later = revisions.iter().filter(|r| (from..from + 60).contains(&(r.frame.number as usize)));
        later.map(Revision::to_json).collect()
    };
    // The files hold more than belongs to a state; of the later one first, as they are cut to it.
    for (stop, state) in stops.into_iter().zip(&states).rev() {
        let resumed = |rows: usize| named().resumed(postcard::from_bytes(state).unwrap(), rows);
        assert!(resumed(stop + 1).is_err());
        let mut again = resumed(stop).unwrap();
        assert!(postcard::to_stdvec(&again.state().unwrap()).unwrap() == *state);
        let found = drive_on(&mut again, &scene, stop..stop + 60, &settings);
        assert!(!found.is_empty() && lines(&found, stop) == lines(&revisions, stop), "after {stop} rows");
        if stop == stops[1] {
            assert!(postcard::to_stdvec(&again.state().unwrap()).unwrap() == states[2]);
            assert_eq!(again.finish(&settings, Stop::NEVER).1, None);
        }
    }
}
