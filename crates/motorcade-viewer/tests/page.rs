//! A page of a run made by hand.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade::{Config, NoProgress, RunResult};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_geometry::Pose;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Dimensions, Source, VehicleState, VehicleTrajectory};
use nalgebra::{Matrix3, Matrix6};

const HOSTILE: &str = "</pre><script>alert('x')</script>";

/// A run on three grey frames: nothing is tracked, and the page must still be one, also of what the run is changed to.
fn page(change: impl FnOnce(&mut RunResult)) -> String {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..3 {
        image::GrayImage::new(64, 48).save(folder.path().join(format!("{k}.png"))).unwrap();
    }
    let calibration = "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\nfps = 10.0\n";
    std::fs::write(folder.path().join("calibration.toml"), calibration).unwrap();
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let config = Config::default();
    let mut slam = motorcade::Motorcade::builder(sequence.camera().unwrap()).height_m(1.5).build().unwrap();
    motorcade::push_sequence(&mut slam, &sequence, 1, &NoProgress, &mut |_| ()).unwrap();
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
        fingerprint: "0".into(),
    };
    motorcade_viewer::report(&result, &context, None)
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

#[test]
fn a_vehicle_is_seen_whatever_tells_of_it() {
    let state = |source: Source| VehicleState {
        frame: 1,
        world_from_vehicle: Pose::identity(),
        covariance: Matrix6::identity(),
        bbox: None,
        score: 0.9,
        speed_mps: 3.0,
        speed_sigma_mps: 1.0,
        yaw_rate_radps: 0.0,
        source,
        measurement: None,
        observations: Vec::new(),
    };
    let sources = [Source::Box, Source::Keypoints, Source::External, Source::Predicted];
    let vehicle = VehicleTrajectory {
        id: 7,
        class: VehicleClass::Car,
        size: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
        size_covariance: Matrix3::identity(),
        size_by_road: None,
        p_moving: 0.9,
        states: sources.map(state).to_vec(),
    };
    let page = page(|run| {
        run.detects_vehicles = true;
        run.vehicles = vec![vehicle];
    });
    assert!(page.contains("<td>3 of 4</td>"), "predicted alone is not seen");
}
