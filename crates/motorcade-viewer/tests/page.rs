//! A page of a run made by hand.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade::{Config, NoProgress, RunResult};
use motorcade_dataset::{Frame, Sequence, SequenceOptions};
use motorcade_geometry::Pose;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Dimensions, Source, VehicleState, VehicleTrajectory};
use motorcade_viewer::{Pictures, Report};
use nalgebra::{Matrix3, Matrix6, Vector3};

const HOSTILE: &str = "</pre><script>alert('x')</script>";

/// A run on three grey frames: nothing is tracked, and the page must still be one, also of what the run is changed to.
fn page(change: impl FnOnce(&mut RunResult)) -> String {
    page_with(change, None)
}

/// The same with other pictures than those of the three frames.
fn page_with(change: impl FnOnce(&mut RunResult), pictures: Option<&Pictures>) -> String {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..3 {
        image::GrayImage::new(64, 48).save(folder.path().join(format!("{k}.png"))).unwrap();
    }
    let calibration = "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\nfps = 10.0\n";
    std::fs::write(folder.path().join("calibration.toml"), calibration).unwrap();
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let config = Config::default();
    let mut slam = motorcade::Motorcade::builder(sequence.camera().unwrap()).height_m(1.5).build().unwrap();
    motorcade::push_sequence(&mut slam, &sequence, 1, &NoProgress, &mut |_, _| ()).unwrap();
    let mut result = slam.finish();
    // Times differ from run to run; the page must not.
    result.stopwatch = motorcade::Stopwatch::default();
    change(&mut result);
    let context = motorcade::RunContext {
        config,
        camera_from_cam0: sequence.camera_from_cam0(),
        input: motorcade_dataset::Summary { input_hash: "0".into(), ..sequence.summary() },
        perception: (HOSTILE.into(), "geometry".into()),
        command: vec!["motorcade".into(), HOSTILE.into()],
        fingerprint: None,
    };
    let mut own = Pictures::new(3);
    for frame in sequence.frames() {
        own.push(frame.as_ref().ok());
    }
    let pictures = pictures.unwrap_or(&own).taken();
    Report { result: &result, context: &context, evaluation: None, pictures }.html()
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(page(|_| ()), page(|_| ()));
}

#[test]
fn text_stays_text() {
    let page = page(|run| run.warnings.push(HOSTILE.to_owned()));
    assert!(!page.contains("alert('x')"));
    assert_eq!(page.matches("<script>").count(), 1, "the page's own");
    assert_eq!(page.matches("&lt;script&gt;").count(), 3, "warning, command, source of vehicles");
}

#[test]
fn a_drive_without_motion_still_has_a_map() {
    let page = page(|_| ());
    assert!(page.contains("class=\"map\"") && page.contains("No vehicles were looked for"));
    assert!(page.contains("filled in: before the map began (3)"));
    assert!(!page.contains("NaN"));
    for tag in ["section", "svg", "figure", "table", "g", "p"] {
        let (opened, closed) = (
            page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count(),
            page.matches(&format!("</{tag}>")).count(),
        );
        assert_eq!(opened, closed, "{tag}");
    }
}

/// Identity `id`, seen in the frames given.
fn car(id: usize, states: Vec<VehicleState>) -> VehicleTrajectory {
    VehicleTrajectory {
        id,
        class: VehicleClass::Car,
        size: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
        size_covariance: Matrix3::identity(),
        size_by_road: None,
        p_moving: 0.9,
        states,
    }
}

fn state(frame: usize, source: Source, x_m: f64, z_m: f64) -> VehicleState {
    VehicleState {
        frame,
        world_from_vehicle: Pose::from_parts(
            nalgebra::UnitQuaternion::identity(),
            Vector3::new(x_m, 1.5, z_m),
        ),
        covariance: Matrix6::identity(),
        bbox: None,
        score: 0.9,
        speed_mps: 3.0,
        speed_sigma_mps: 1.0,
        yaw_rate_radps: 0.0,
        source,
        measurement: None,
        observations: Vec::new(),
        heading_variance: 0.0,
        rival: None,
    }
}

#[test]
fn a_vehicle_is_seen_whatever_shows_it() {
    let sources = [Source::Box, Source::Keypoints, Source::External, Source::Predicted];
    let vehicle = car(7, sources.map(|source| state(1, source, 0.0, 0.0)).to_vec());
    let page = page(|run| {
        run.detects_vehicles = true;
        run.vehicles = vec![vehicle];
    });
    assert!(page.contains("<td>3 of 4</td>"), "predicted alone is not seen");
}

/// Frames of an hour at 10 frames/s.
const HOUR: usize = 36_000;

/// Pictures of an hour whose JPEGs are as large as those of KITTI 0005 (25 kB): a sky over waves and grain.
fn pictures_of_an_hour() -> Pictures {
    let mut grain = 1_u32;
    let image = image::RgbImage::from_fn(621, 188, |x, y| {
        grain = grain.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let wave = 60.0 * ((x as f64 * 0.11).sin() + (y as f64 * 0.17 + x as f64 * 0.02).cos());
        let rough = if y < 60 { 0.1 } else { 1.0 };
        let value = (128.0 + rough * (wave + f64::from(grain >> 26))).clamp(0.0, 255.0) as u8;
        image::Rgb([value, value.saturating_add(10), 90])
    });
    let mut frame = Frame::from_rgb(image, 0);
    let mut pictures = Pictures::new(HOUR);
    for number in 0..HOUR as u64 {
        frame.number = number;
        pictures.push(Some(&frame));
    }
    pictures
}

/// An hour with 300 vehicles, left for the browser of `scripts/check_report.sh`.
#[test]
fn the_page_of_an_hour_is_not_too_large() {
    let pictures = pictures_of_an_hour();
    let hour = |run: &mut RunResult| {
        run.detects_vehicles = true;
        let (first, ego) = (run.frames[0].clone(), run.ego.frames[0].clone());
        run.frames.clear();
        run.ego.frames.clear();
        for k in 0..HOUR as u64 {
            let (mut frame, mut ego) = (first.clone(), ego.clone());
            let angle = k as f64 * 1e-3;
            frame.number = k;
            frame.timestamp_ns = k as i64 * 100_000_000;
            let at = Vector3::new(800.0 * (1.0 - angle.cos()), 0.0, 800.0 * angle.sin());
            ego.world_from_camera = Pose::from_parts(nalgebra::UnitQuaternion::identity(), at);
            run.frames.push(frame);
            run.ego.frames.push(ego);
        }
        let track = |id: usize| {
            let rows = (0..400).map(|s| id * 118 + s);
            let at = |row: usize| {
                let angle = (row + 20) as f64 * 1e-3;
                (800.0 * (1.0 - angle.cos()), 800.0 * angle.sin())
            };
            car(id, rows.map(|row| state(row, Source::Box, at(row).0, at(row).1)).collect())
        };
        run.vehicles = (0..300).map(track).collect();
    };
    let page = page_with(hour, Some(&pictures));
    let jpegs = page.split_once("\"jpeg\":[").and_then(|(_, rest)| rest.find(']')).unwrap();
    assert!((6_000_000..11_000_000).contains(&jpegs), "{jpegs} bytes of pictures are not those of real ones");
    assert!(page.len() < 25_000_000, "{} bytes", page.len());
    std::fs::write(format!("{}/hour.html", env!("CARGO_TARGET_TMPDIR")), page).unwrap();
}

#[test]
fn extremes_are_quoted_of_what_was_measured() {
    let quoted = |tracked: bool| {
        let page = page(|run| {
            run.ego.frames.iter_mut().for_each(|frame| frame.step_measured = tracked);
            let states = vec![state(1, Source::Box, 0.0, 20.0), state(2, Source::Predicted, 0.0, 6.0)];
            run.vehicles = vec![car(1, states)];
        });
        let from = page.find("<h2>In short</h2>").unwrap();
        let section = &page[from..];
        section[..section.find("</section>").unwrap()].to_owned()
    };
    let found = quoted(true);
    assert!(found.contains("shortest distance ahead") && found.contains("vehicle 1, at 0.1 s"), "{found}");
    assert!(found.contains("highest speed") && !found.contains("vehicle 1, at 0.2 s"), "{found}");
    let found = quoted(false);
    assert!(found.contains("frames with a vehicle ahead"), "{found}");
    assert!(!found.contains("shortest") && !found.contains("highest"), "{found}");
}
