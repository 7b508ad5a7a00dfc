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
        assert!(said("7 of 10 frames, numbers 0 to 6"), "{:?}", result.warnings);
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
fn an_online_run_forgets_old_rows_and_reports_the_same() {
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
    let right = swaying(1.0);
    assert!(right.iter().all(|w| !w.contains("disagrees with") && !w.contains("far apart")), "{right:?}");
    let long = said(1.1).unwrap();
    assert!(long.contains("the focal length of 429 px") && long.contains("motorcade calibrate"), "{long}");
}

/// A drive along a street of which the clock jumps ahead by so many seconds before frame 25.
fn jumping(seconds: i64, online: bool, skipped_m: f64) -> motorcade::RunResult {
    let mut config = Config::default();
    config.online.enabled = online;
    let mut slam = Motorcade::builder(CAMERA).height_m(1.5).config(config).build().unwrap();
    for k in 0..45_i64 {
        let late = k >= 25;
        let way_m = 0.8 * k as f64 + if late { skipped_m } else { 0.0 };
        let image = street_image(&CAMERA, &StreetPose::along(way_m));
        let time_ns = k * 100_000_000 + if late { seconds * 1_000_000_000 } else { 0 };
        let frame = Frame { number: k as u64, ..Frame::from_gray(image, time_ns) };
        if online {
            slam.step(&frame).unwrap();
        } else {
            slam.push(&frame).unwrap();
        }
    }
    if online { slam.finish_online(&NoProgress) } else { slam.finish() }
}

#[test]
fn jumps_of_the_clock_are_said_and_do_not_move_the_camera() {
    for (seconds, online) in [(2, false), (3600, true)] {
        let result = jumping(seconds, online, 0.0);
        let said = result.warnings.iter().find(|w| w.contains("far apart in time")).unwrap();
        assert!(said.contains("frames 24 and 25") && said.contains("the pictures go on"), "{said}");
        let way_m = result.ego.length_m();
        assert!((way_m - 35.2).abs() < 3.0, "{seconds} s, online {online}: {way_m} m");
    }
    // Frames that are missing: the camera is elsewhere.
    let result = jumping(3, false, 24.0);
    let said = result.warnings.iter().find(|w| w.contains("far apart in time")).unwrap();
    assert!(said.contains("the way between is assumed"), "{said}");
}

/// Warnings of a drive along a street whose pictures are changed.
fn warned(online: bool, change: impl Fn(i64, image::GrayImage) -> image::GrayImage) -> Vec<String> {
    let mut config = Config::default();
    config.online.enabled = online;
    let mut slam = Motorcade::builder(CAMERA).height_m(1.5).config(config).build().unwrap();
    for k in 0..40_i64 {
        let image = change(k, street_image(&CAMERA, &StreetPose::along(0.8 * k as f64)));
        slam.push(&Frame { number: k as u64, ..Frame::from_gray(image, k * 100_000_000) }).unwrap();
    }
    let result = if online { slam.finish_online(&NoProgress) } else { slam.finish() };
    result.warnings
}

/// Words of the faults of pictures.
const PICTURE_FAULTS: [&str; 4] =
    ["exposure jumps", "lost all texture", "blurs in frame", "shifted as a whole"];

#[test]
fn faults_of_pictures_are_said_by_their_frames_and_clean_drives_have_none() {
    let clean = warned(false, |_, image| image);
    assert!(!clean.iter().any(|w| PICTURE_FAULTS.iter().any(|fault| w.contains(fault))), "{clean:?}");
    let dark = |k, mut image: image::GrayImage| {
        if k >= 25 {
            image.pixels_mut().for_each(|p| p.0[0] /= 2);
        }
        image
    };
    for online in [false, true] {
        let said = warned(online, dark);
        assert!(said.iter().any(|w| w.contains("exposure jumps") && w.contains("in frame 25;")), "{said:?}");
    }
    let half = |k, mut image: image::GrayImage| {
        let left = image.width() / 2;
        let grey = image.enumerate_pixels_mut().filter(|(x, ..)| (25..30).contains(&k) && *x < left);
        grey.for_each(|(.., p)| p.0[0] = 128);
        image
    };
    let said = warned(false, half);
    assert!(
        said.iter().any(|w| w.contains("lost all texture") && w.contains("in frames 25 to 29:")),
        "{said:?}"
    );
    let lower = |k, image: image::GrayImage| {
        let by = if (25..30).contains(&k) { 10 } else { 0 };
        let last = image.height() - 1;
        image::GrayImage::from_fn(image.width(), image.height(), |x, y| {
            *image.get_pixel(x, (y + by).min(last))
        })
    };
    let said = warned(false, lower);
    assert!(
        said.iter().any(|w| w.contains("shifted as a whole by up to") && w.contains("in frames 25, 30:")),
        "{said:?}"
    );
}
