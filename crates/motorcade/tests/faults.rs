//! Faults of detectors and pictures: the results hold what there is, and say what is wrong with it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use motorcade::dataset::{Frame, Sequence, SequenceOptions};
use motorcade::geometry::PinholeCamera;
use motorcade::perception::{Detection, Error, VehicleDetector};
use motorcade::{Config, Motorcade, NoProgress, push_sequence};
use motorcade_testing::street_image::{CAMERA, StreetPose, street_image};

/// Fails by a fault of its own at one frame.
struct Faulty(u64);

impl VehicleDetector for Faulty {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>, Error> {
        assert!(frame.number != self.0, "an index out of range");
        Ok(Vec::new())
    }
    fn description(&self) -> String {
        "a detector with a fault".into()
    }
}

#[test]
fn a_worker_that_panics_ends_the_frames_and_not_the_results() {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..10 {
        let image = street_image(&CAMERA, &StreetPose::along(f64::from(k)));
        image.save(folder.path().join(format!("{k:06}.png"))).unwrap();
    }
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let mut poses = Vec::new();
    for threads in [1, 2, 4] {
        let mut slam = Motorcade::builder(CAMERA).height_m(1.5).detector(Faulty(7)).build().unwrap();
        push_sequence(&mut slam, &sequence, threads, &NoProgress, &mut |_, _| {}).unwrap();
        let result = slam.finish();
        assert!(result.failed && result.interrupted && result.ego.frames.len() == 7, "{threads} threads");
        let said = |words: &str| result.warnings.iter().any(|w| w.contains(words));
        assert!(said("frame 7: a fault of the program in its detectors (an index out of range)"));
        assert!(said("frames 0 to 6 of 10"), "{:?}", result.warnings);
        poses.push(format!("{:?}", result.ego.frames));
    }
    assert!(poses.iter().all(|p| *p == poses[0]));
}

/// A drive along a street by the way at each frame \[m\], taken frame by frame.
fn driven(online: bool, way_m: &[f64]) -> (Motorcade, Vec<String>) {
    let mut config = Config::default();
    config.online.enabled = online;
    // Windows are short, so that rows leave them soon.
    config.online.scale_s = 3.0;
    let mut slam = Motorcade::builder(CAMERA).height_m(1.5).config(config).build().unwrap();
    let lines = way_m.iter().enumerate().map(|(k, way)| {
        let image = street_image(&CAMERA, &StreetPose::along(*way));
        let frame = Frame { number: k as u64, ..Frame::from_gray(image, k as i64 * 100_000_000) };
        slam.step(&frame).unwrap().to_json()
    });
    let lines = lines.collect();
    (slam, lines)
}

#[test]
fn two_swapped_pictures_are_said_to_be() {
    let mut way_m: Vec<f64> = (0..40).map(|k| 0.8 * f64::from(k)).collect();
    way_m.swap(25, 26);
    for online in [false, true] {
        let (slam, _) = driven(online, &way_m);
        let result = if online { slam.finish_online(&NoProgress) } else { slam.finish() };
        let said =
            result.warnings.iter().any(|w| w.contains("frames 25 and 26 seem to be in the wrong order"));
        assert!(said, "{:?}", result.warnings);
    }
}

#[test]
fn an_online_run_forgets_old_rows_and_tells_the_same() {
    let way_m: Vec<f64> = (0..400).map(|k| 0.2 * f64::from(k)).collect();
    let (kept, all) = driven(false, &way_m);
    let (forgetting, same) = driven(true, &way_m);
    assert_eq!(all, same);
    let result = kept.finish_online(&NoProgress);
    // A drive whose motion is forgotten stays as it was estimated, however it is ended.
    let forgotten = forgetting.finish();
    assert_eq!(format!("{:?}", forgotten.ego.frames), format!("{:?}", result.ego.frames));
    assert!(forgotten.road_measurements.len() < result.road_measurements.len());
    assert_eq!(forgotten.road_measurement_count, result.road_measurement_count);
}

/// A drive along a street that sways by 20° to either side, by a camera whose focal length is stated as `factor` of the true one.
fn swaying(factor: f64) -> Vec<String> {
    let stated = PinholeCamera { fx: factor * CAMERA.fx, fy: factor * CAMERA.fy, ..CAMERA };
    let mut slam = Motorcade::builder(stated).height_m(1.5).build().unwrap();
    let (mut along_m, mut across_m) = (0.0, 0.0);
    for k in 0..90 {
        let heading_rad = 0.35 * (f64::from(k) / 7.0).sin();
        along_m += 0.4 * heading_rad.cos();
        across_m += 0.4 * heading_rad.sin();
        let image = street_image(&CAMERA, &StreetPose { across_m: across_m - 1.0, along_m, heading_rad });
        let frame = Frame { number: k as u64, ..Frame::from_gray(image, i64::from(k) * 100_000_000) };
        slam.push(&frame).unwrap();
    }
    slam.finish().warnings
}

#[test]
fn a_focal_length_that_the_turns_contradict_is_said() {
    let said = |factor: f64| swaying(factor).into_iter().find(|w| w.contains("disagrees with the drive"));
    assert_eq!(said(1.0), None);
    let long = said(1.08).unwrap();
    assert!(long.contains("the focal length of 421 px") && long.contains("motorcade calibrate"), "{long}");
}
