//! A drive that goes on from its state after a frame gives the bits of the unbroken one.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use image::{GrayImage, Luma};
use motorcade::dataset::Frame;
use motorcade::{
    Config, External, ExternalTrajectory, FrontEndRecord, Motorcade, NoProgress, Preset, RunResult,
};
use motorcade_geometry::Pose;
use motorcade_multibody::CameraCoupling;
use motorcade_perception::{
    BoundingBox, BoxConvention, Detection, Observations, RoadMask, VehicleClass, VehicleKeypoints,
};
use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};
use motorcade_testing::street_image::{HALF_CAMERA, HEIGHT_M, StreetPose, street_image};
use nalgebra::{Point2, UnitQuaternion, Vector2, Vector3};

/// Frames after which some rows are put away.
const LONG: u64 = 290;

/// Rows that do not read, repeat the one before, and are black.
const MISSING: u64 = 11;
const REPEATED: u64 = 14;
const BLACK: std::ops::Range<u64> = 20..24;

/// The way driven to a frame \[m\]: the camera stands for a while.
fn way_m(k: u64) -> f64 {
    0.8 * k.min(32).saturating_add(k.saturating_sub(40)) as f64
}

/// Columns and rows of the car ahead, which drives as the camera does.
const AHEAD: [u32; 4] = [104, 52, 136, 74];

fn picture(k: u64) -> GrayImage {
    if BLACK.contains(&k) {
        return GrayImage::new(HALF_CAMERA.width, HALF_CAMERA.height);
    }
    let k = if k == REPEATED { k - 1 } else { k };
    // A curve, for the check of the focal length.
    let heading_rad = 0.1 * (0.05 * k as f64).sin();
    let mut image = street_image(&HALF_CAMERA, &StreetPose { heading_rad, ..StreetPose::along(way_m(k)) });
    let [x1, y1, x2, y2] = AHEAD;
    for (x, y) in (y1..y2).flat_map(|y| (x1..x2).map(move |x| (x, y))) {
        image.put_pixel(x, y, Luma([((x * 53 + y * 91 + x * y * 7) % 199) as u8]));
    }
    image
}

fn car([x1, y1, x2, y2]: [f64; 4], score: f64) -> Detection {
    Detection {
        class: VehicleClass::Car,
        score,
        bbox: BoundingBox::new([x1, y1, x2, y2]),
        convention: BoxConvention::VisibleExtent,
        external_id: None,
        pixel_size: 1.0,
        road_below: None,
    }
}

/// A car that moves, one that stands before a wall, keypoints now and then, and a mask of the road in every other frame.
fn observations(k: u64, masks: bool) -> Observations {
    let mut detections = vec![car(AHEAD.map(f64::from), 0.9)];
    let ahead_m = 40.0 - way_m(k) % 34.0;
    let at = |x: f64, y: f64| {
        (HALF_CAMERA.fx * x / ahead_m + HALF_CAMERA.cx, HALF_CAMERA.fy * y / ahead_m + HALF_CAMERA.cy)
    };
    let ((x1, y1), (x2, y2)) = (at(4.2, -0.1), at(5.9, HEIGHT_M));
    detections.push(car([x1, y1, x2.min(238.0), y2.min(118.0)], 0.8));
    let point = |i: usize| ObservedKeypoint {
        pixel: Point2::new(x1 + i as f64 / 7.0, y1 + i as f64 / 3.0),
        confidence: 0.5 + 0.01 * i as f64,
        sigma_px: i.is_multiple_of(2).then_some(Vector2::new(0.7, 1.1)),
    };
    let keypoints = VehicleKeypoints {
        layout: Layout::Car14,
        points: (0..14).map(point).collect(),
        bbox: detections[1].bbox,
        heading: HeadingEvidence::from_probabilities(vec![0.25; 4]),
        presence: Some(0.3),
    };
    let road = GrayImage::from_fn(60, 30, |_, y| Luma([if y > 14 { 230 } else { 10 }]));
    let road =
        (masks && k.is_multiple_of(2)).then(|| RoadMask::new(road, HALF_CAMERA.width, HALF_CAMERA.height));
    Observations {
        detections,
        road,
        keypoints: if k.is_multiple_of(3) { vec![keypoints] } else { Vec::new() },
    }
}

/// A kind of drive.
#[derive(Clone, Copy)]
struct Kind {
    config: Config,
    masks: bool,
    readout_s: f64,
    /// Every frame is estimated when it comes.
    estimated: bool,
    /// The camera's motion is given, in metres or in another unit.
    trajectory: Option<bool>,
}

impl Kind {
    fn plain() -> Self {
        Self { config: Config::default(), masks: false, readout_s: 0.0, estimated: false, trajectory: None }
    }

    fn slam(&self, folder: &Path) -> Motorcade {
        let builder = Motorcade::builder(HALF_CAMERA).height_m(HEIGHT_M).config(self.config);
        let pose = |k: u64| Pose::from_parts(UnitQuaternion::identity(), Vector3::z() * way_m(k));
        let trajectory = self.trajectory.map(|metric| ExternalTrajectory {
            world_from_camera: (0..2 * LONG).map(pose).collect(),
            metric,
        });
        let builder = builder.external(External { trajectory, ..External::default() });
        let mut slam = builder.readout_s(self.readout_s).build().unwrap();
        slam.put_rows_in(folder);
        slam
    }

    /// Takes a frame; the line of its estimate, where there is one.
    fn take(&self, slam: &mut Motorcade, k: u64) -> Option<String> {
        let time_ns = k as i64 * 100_000_000;
        if k == MISSING {
            slam.skip(k, time_ns, "did not read").unwrap();
        } else {
            let frame = Frame { number: k, ..Frame::from_gray(picture(k), time_ns) };
            slam.push_observed(&frame, observations(k, self.masks), 1.0).unwrap();
        }
        self.estimated.then(|| format!("{:?}", slam.estimate().unwrap()))
    }
}

/// All of a record but the times of stages, by the shortest text of each number that reads back as the same bits.
fn text(slam: Motorcade) -> String {
    if slam.settings().config.online.enabled {
        let RunResult { frames, ego, vehicles, road_measurements, warnings, .. } =
            slam.finish_online(&NoProgress);
        return format!("{frames:?}\n{ego:?}\n{vehicles:?}\n{road_measurements:?}\n{warnings:?}");
    }
    let FrontEndRecord { frames, detections, keypoints, motion, road_measurements, places, warnings, .. } =
        slam.into_record().0;
    format!(
        "{frames:?}\n{detections:?}\n{keypoints:?}\n{motion:?}\n{road_measurements:?}\n{places:?}\n{warnings:?}"
    )
}

/// Goes on after each of these numbers of frames of a drive.
fn goes_on(kind: &Kind, frames: u64, after: &[u64]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let rows = folder.path().join("rows");
    let mut whole = kind.slam(&rows);
    let (mut states, mut lines) = (Vec::new(), Vec::new());
    for k in 0..frames {
        lines.push(kind.take(&mut whole, k));
        if after.contains(&(k + 1)) {
            states.push((k + 1, whole.state().unwrap()));
        }
    }
    let whole = text(whole);
    if frames > LONG {
        let away = if kind.estimated {
            ["detections", "poses", "vehicles"]
        } else {
            ["detections", "keypoints", "motion"]
        };
        assert!(away.iter().all(|name| rows.join(name).exists()), "{away:?} in {rows:?}");
    }
    for (taken, state) in states {
        // The files of a run that was killed later are longer than in the state.
        let copy = folder.path().join(taken.to_string());
        fs::create_dir_all(&rows).unwrap();
        fs::create_dir(&copy).unwrap();
        for file in fs::read_dir(&rows).unwrap().map(Result::unwrap) {
            fs::copy(file.path(), copy.join(file.file_name())).unwrap();
        }
        let mut slam = kind.slam(&copy);
        slam.resume(&state).unwrap();
        assert_eq!((slam.frames() as u64, slam.state().unwrap() == state), (taken, true), "{taken}");
        (taken..frames).for_each(|k| assert!(kind.take(&mut slam, k) == lines[k as usize], "{taken} {k}"));
        assert!(text(slam) == whole, "after {taken} frames");
    }
    whole
}

#[test]
fn a_drive_goes_on_after_any_frame_with_the_same_bits() {
    // While the first map is made, after gaps, in a stand, on the way.
    let whole = goes_on(&Kind::plain(), 75, &[1, 2, 4, 12, 15, 22, 27, 36, 60]);
    for part in ["Tracked", "Standstill", "Bridged", "RoadMeasurement", "PlaceKeyframe", "ObservedKeypoint"] {
        assert!(whole.contains(part), "{part}");
    }
}

#[test]
fn rows_that_were_put_away_come_back() {
    goes_on(&Kind::plain(), LONG + 10, &[LONG]);
}

fn online() -> Kind {
    let mut kind = Kind { estimated: true, ..Kind::plain() };
    kind.config.online.enabled = true;
    kind
}

#[test]
fn a_drive_that_is_estimated_online_goes_on_with_the_same_bits() {
    let whole = goes_on(&online(), 75, &[1, 2, 4, 12, 15, 22, 27, 36, 60]);
    for part in ["Tracked", "Bridged", "Keypoints", "VehicleTrajectory"] {
        assert!(whole.contains(part), "{part}");
    }
    // Boxes, cameras and states of vehicles are put away; only some frames are estimated in full.
    let mut sparse = online();
    (sparse.config.online.interval_s, sparse.config.online.scale_s) = (0.3, 2.5);
    sparse.config.online.advanced.forget_after_s = 1.0;
    goes_on(&sparse, LONG + 25, &[LONG + 15]);
}

#[test]
fn a_camera_that_moves_with_the_vehicles_and_no_graph_at_all_go_on_too() {
    let mut free = online();
    free.config.graph.camera = CameraCoupling::Free;
    let mut without = online();
    without.config.graph.enabled = false;
    let paper = Kind { config: Config::preset(Preset::Paper), ..Kind::plain() };
    let mut paper = Kind { estimated: true, ..paper };
    paper.config.online.enabled = true;
    for kind in [free, without, paper] {
        goes_on(&kind, 50, &[3, 30, 41]);
    }
}

#[test]
fn estimates_beside_a_drive_that_is_estimated_as_a_whole_go_on_too() {
    goes_on(&Kind { estimated: true, ..Kind::plain() }, 50, &[3, 30, 41]);
}

#[test]
fn a_drive_on_a_given_trajectory_goes_on_with_the_same_bits() {
    for metric in [true, false] {
        let given = Kind { trajectory: Some(metric), ..Kind::plain() };
        goes_on(&given, 55, &[3, 30, 45]);
        goes_on(&Kind { trajectory: Some(metric), ..online() }, 55, &[3, 30, 45]);
    }
}

#[test]
fn all_sources_of_scale_and_rolling_shutters_go_on_too() {
    let mut points = Kind::plain();
    points.config.scale.points = true;
    let paper = Kind { config: Config::preset(Preset::Paper), ..Kind::plain() };
    let mut unmeasured = Kind::plain();
    unmeasured.config.scale.road = false;
    let rolling = Kind { readout_s: 0.03, masks: true, ..Kind::plain() };
    for kind in [points, paper, unmeasured, rolling] {
        goes_on(&kind, 55, &[3, 30, 45]);
    }
}

#[test]
fn states_that_do_not_fit_are_refused_and_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (kind, rows) = (Kind::plain(), folder.path().join("rows"));
    let mut slam = kind.slam(&rows);
    (0..LONG).for_each(|k| drop(kind.take(&mut slam, k)));
    let state = slam.state().unwrap();
    let motion = rows.join("motion");
    let whole = fs::read(&motion).unwrap();
    let refused = |kind: &Kind, state: &[u8]| {
        let mut slam = kind.slam(&rows);
        slam.resume(state).unwrap_err();
        assert_eq!(slam.frames(), 0);
        kind.take(&mut slam, 0);
    };
    for end in [0, 1, state.len() / 2, state.len() - 1] {
        refused(&kind, &state[..end]);
    }
    refused(&kind, &[state.as_slice(), &[0]].concat());
    refused(&Kind { config: Config::preset(Preset::Paper), ..kind }, &state);
    fs::write(&motion, &whole[..whole.len() - 1]).unwrap();
    refused(&kind, &state);
    let mut damaged = whole.clone();
    damaged[100] ^= 1;
    fs::write(&motion, &damaged).unwrap();
    refused(&kind, &state);
    fs::remove_file(&motion).unwrap();
    refused(&kind, &state);
    fs::write(&motion, &whole).unwrap();
    let mut again = kind.slam(&rows);
    again.resume(&state).unwrap();
    assert!(again.resume(&state).is_err(), "frames were taken already");
    // Rows in files without a name are gone with their process.
    let mut nameless = Motorcade::builder(HALF_CAMERA).height_m(HEIGHT_M).build().unwrap();
    assert!(nameless.resume(&state).is_err());
    (0..LONG).for_each(|k| drop(kind.take(&mut nameless, k)));
    assert!(nameless.state().is_err());
}
