//! On real network outputs (`keypoints`) against KITTI's 3D labels, when they are there. Labels give the 2D box, which is
//! part of the data format, and judge the result; nothing else of them reaches the fit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests

use std::path::Path;

use motorcade_dataset::{KittiCalibration, Label, read_labels};
use motorcade_geometry::robust::median;
use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use motorcade_shape::fit::{FitOptions, MeasuredRoad, Observation, ShapeFitter};
use motorcade_shape::{ConvertOptions, Dimensions, FitError, Layout, ShapePrior, SizePrior, convert};
use nalgebra::{Matrix3, Vector3};

/// File, sequence, first frame, track. The name of the last file lacks its track: of those in view it fits 14's box.
const TRACKS: [(&str, &str, u64, i64); 6] = [
    ("keypoints_2_90-100_1.txt", "0002", 90, 1),
    ("keypoints_5_182-190_12.txt", "0005", 182, 12),
    ("keypoints_5_190-230_31.txt", "0005", 190, 31),
    ("keypoints_5_193-200_17.txt", "0005", 193, 17),
    ("keypoints_7_151_159.txt", "0007", 151, 14),
    ("keypoints_11_0-40_0.txt", "0011", 0, 0),
];

/// Standard deviation of a keypoint as a share of the box: 2 px of the 64 px of a crop.
const SIGMA_SHARE: f64 = 0.03;

struct View {
    file: &'static str,
    camera: PinholeCamera,
    observation: Observation,
    truth: Pose<Camera, Vehicle>,
}

/// KITTI's location and rotation in cam0 as a pose in the camera.
fn truth_of(label: &Label, camera_from_cam0: &Vector3<f64>) -> Pose<Camera, Vehicle> {
    let (s, c) = label.ry_rad.sin_cos();
    let forward = Vector3::new(c, 0.0, -s);
    let left = Vector3::new(s, 0.0, c);
    let rotation = Matrix3::from_columns(&[forward, left, -Vector3::y()]);
    Pose::from_matrix(&rotation, &(Vector3::from(label.location_m) + camera_from_cam0))
}

fn read_outputs(path: &Path) -> Vec<Vec<[f64; 3]>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|n| n.trim().parse().unwrap()).collect();
            numbers.chunks_exact(3).map(|k| [k[0], k[1], k[2]]).collect()
        })
        .collect()
}

fn views() -> Option<Vec<View>> {
    let keypoints = motorcade_testing::shared("keypoints")?;
    let training = motorcade_testing::shared("kitti/tracking/training")?;
    let mut views = Vec::new();
    for (file, sequence, first, track) in TRACKS {
        let path = training.join("calib").join(format!("{sequence}.txt"));
        let calibration = KittiCalibration::read(&path).unwrap().camera(&path, 2).unwrap();
        let camera = calibration.pinhole(&path, 1242, 375).unwrap();
        let labels = read_labels(&training.join("label_02").join(format!("{sequence}.txt"))).unwrap();
        for (row, outputs) in read_outputs(&keypoints.join(file)).iter().enumerate() {
            let frame = first + row as u64;
            let Some(label) = labels.iter().find(|l| l.frame == frame && l.track == track) else { continue };
            let mut observation = Observation::from_crop(outputs, label.bbox.to_array(), 64.0, SIGMA_SHARE);
            observation.road = Some(MeasuredRoad::level(1.65));
            // The prior of class `car` of motorcade-vehicles.
            observation.size = Some(SizePrior {
                mean: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.51 },
                sigma: Dimensions { length_m: 0.45, width_m: 0.1, height_m: 0.1 },
            });
            let truth = truth_of(label, &calibration.camera_from_cam0.translation());
            views.push(View { file, camera, observation, truth });
        }
    }
    Some(views)
}

/// Errors of the views within 30 m that could be fitted.
struct Figures {
    position_share: f64,
    heading_deg: f64,
    fitted: usize,
    /// Facing the wrong way without saying that they may.
    silent_flips: usize,
    near: usize,
}

fn figures(
    name: &str,
    fitter: &ShapeFitter,
    views: &[View],
    change: impl Fn(&View) -> Observation,
) -> Figures {
    let (mut positions, mut headings, mut near) = (Vec::new(), Vec::new(), 0);
    let (mut flipped, mut ambiguous, mut silent) = (0, 0, 0);
    let mut by_file: Vec<(&str, Vec<f64>, Vec<f64>)> = Vec::new();
    for view in views {
        let depth_m = view.truth.translation().z;
        if depth_m > 30.0 {
            continue;
        }
        near += 1;
        let fit = match fitter.fit(&view.camera, &change(view)) {
            Ok(fit) => fit,
            Err(FitError::TooFewKeypoints { .. }) => continue,
            Err(error) => panic!("{}: {error}", view.file),
        };
        let offset = fit.camera_from_vehicle.translation() - view.truth.translation();
        positions.push(offset.norm() / depth_m);
        let heading = crate::common::heading_error_rad(&fit.camera_from_vehicle, &view.truth).to_degrees();
        headings.push(heading);
        flipped += usize::from(heading > 90.0);
        ambiguous += usize::from(fit.heading_is_ambiguous());
        silent += usize::from(heading > 90.0 && !fit.heading_is_ambiguous());
        if by_file.last().is_none_or(|f| f.0 != view.file) {
            by_file.push((view.file, Vec::new(), Vec::new()));
        }
        if let Some((_, p, h)) = by_file.last_mut() {
            p.push(offset.norm() / depth_m);
            h.push(heading);
        }
    }
    let fitted = positions.len();
    let (position_share, heading_deg) = (median(&mut positions).unwrap(), median(&mut headings).unwrap());
    println!(
        "{name}: {fitted} of {near} within 30 m; median position {:.1} % of depth (90 %: {:.1}), heading {:.1}° \
         (90 %: {:.1}), {flipped} flipped, {ambiguous} called ambiguous",
        100.0 * position_share,
        100.0 * positions[positions.len() * 9 / 10],
        heading_deg,
        headings[headings.len() * 9 / 10],
    );
    for (file, mut p, mut h) in by_file {
        let (p, h, n) = (median(&mut p).unwrap(), median(&mut h).unwrap(), p.len());
        println!("    {file}: {n} views, {:.1} %, {h:.1}°", 100.0 * p);
    }
    Figures { position_share, heading_deg, fitted, silent_flips: silent, near }
}

#[test]
fn position_within_8_percent_and_heading_within_10_degrees() {
    let Some(views) = views() else { return };
    assert_eq!(views.len(), 120, "rows with a label");
    let fitter = ShapeFitter::new(ShapePrior::of_family(Layout::Car14), FitOptions::default());
    let with_road = figures("road", &fitter, &views, |v| v.observation.clone());
    let loose = |v: &View| {
        let road = Some(MeasuredRoad { slope_sigma_rad: 1.0_f64.to_radians(), ..MeasuredRoad::level(1.65) });
        Observation { road, ..v.observation.clone() }
    };
    let with_loose = figures("road known to 1°", &fitter, &views, loose);
    let without = |v: &View| Observation { road: None, ..v.observation.clone() };
    let without_road = figures("neither", &fitter, &views, without);
    // On the views both can fit: the road must help there, not only by letting more views in.
    let both: Vec<View> = views.into_iter().filter(|v| fitter.fit(&v.camera, &without(v)).is_ok()).collect();
    let same_with = figures("road, same views as without", &fitter, &both, |v| v.observation.clone());

    assert_eq!(with_road.fitted, with_road.near);
    assert_eq!(with_road.silent_flips, 0);
    for found in [&with_road, &with_loose] {
        assert!(found.position_share <= 0.08, "{}", found.position_share);
        assert!(found.heading_deg <= 10.0, "{}", found.heading_deg);
    }
    assert!(without_road.fitted > 20);
    assert!(same_with.position_share < without_road.position_share);
}

/// One shape for all frames of a track; the road as above. Fitted together, and frame by frame with the shape that twelve frames
/// spread over the track agree on, as the pipeline does: closer than each frame alone.
#[test]
fn tracks_of_real_outputs_share_a_shape() {
    let Some(views) = views() else { return };
    let fitter = ShapeFitter::new(ShapePrior::of_family(Layout::Car14), FitOptions::default());
    let [mut together, mut shaped, mut alone] = [Errors::default(), Errors::default(), Errors::default()];
    for (file, ..) in TRACKS {
        let of_track: Vec<&View> = views.iter().filter(|v| v.file == file).collect();
        let observations: Vec<Observation> = of_track.iter().map(|v| v.observation.clone()).collect();
        let camera = &of_track[0].camera;
        let track = fitter.fit_track(camera, &observations).unwrap();
        assert_eq!(track.frames.len(), of_track.len());
        let every = observations.len().div_ceil(12);
        let some: Vec<Observation> = observations.iter().step_by(every).cloned().collect();
        let shape = fitter.fit_track(camera, &some).unwrap().shape;
        for (view, frame) in of_track.iter().zip(&track.frames) {
            let near = |pose: &Pose<Camera, Vehicle>, errors: &mut Errors| errors.add(pose, &view.truth);
            frame.iter().for_each(|f| near(&f.camera_from_vehicle, &mut together));
            let fits =
                [fitter.fit_shaped(camera, &view.observation, &shape), fitter.fit(camera, &view.observation)];
            for (fit, errors) in fits.iter().zip([&mut shaped, &mut alone]) {
                fit.iter().for_each(|f| near(&f.camera_from_vehicle, errors));
            }
        }
    }
    let together = together.medians("together");
    let shaped = shaped.medians("with the track's shape");
    let alone = alone.medians("alone");
    for (position, heading) in [together, shaped] {
        assert!(position <= 0.08 && heading <= 10.0);
    }
    assert!(shaped.0 < alone.0, "{} {}", shaped.0, alone.0);
}

/// Errors within 30 m: of the position as a share of depth, of the heading in degrees.
#[derive(Default)]
struct Errors {
    positions: Vec<f64>,
    headings: Vec<f64>,
}

impl Errors {
    fn add(&mut self, pose: &Pose<Camera, Vehicle>, truth: &Pose<Camera, Vehicle>) {
        let depth_m = truth.translation().z;
        if depth_m <= 30.0 {
            self.positions.push((pose.translation() - truth.translation()).norm() / depth_m);
            self.headings.push(crate::common::heading_error_rad(pose, truth).to_degrees());
        }
    }

    fn medians(&mut self, name: &str) -> (f64, f64) {
        let flipped = self.headings.iter().filter(|h| **h > 90.0).count();
        let medians = (median(&mut self.positions).unwrap(), median(&mut self.headings).unwrap());
        let worst = 100.0 * self.positions[self.positions.len() * 9 / 10];
        let (position, heading) = (100.0 * medians.0, medians.1);
        println!(
            "{name}: median position {position:.1} % (90 %: {worst:.1}), heading {heading:.1}°, {flipped} flipped"
        );
        medians
    }
}

/// The published 14 keypoints through the converter, on the same outputs.
#[test]
fn the_published_prior_fits_too() {
    let (Some(views), Some(folder)) = (views(), motorcade_testing::shared("shape_prior")) else { return };
    let [mean, basis] = ["mean_14.txt", "basis_14.txt"].map(|name| folder.join(name));
    let prior = convert(&mean, &basis, &ConvertOptions::new(Layout::Car14)).unwrap();
    let fitter = ShapeFitter::new(prior, FitOptions::default());
    let found = figures("published prior, road", &fitter, &views, |v| v.observation.clone());
    assert!(found.position_share <= 0.08 && found.heading_deg <= 10.0);
}
