//! A camera height that is wrong by some factor makes the camera's whole way longer by that factor, vehicles or not.

#![allow(clippy::unwrap_used, reason = "a test")]

use crate::common::{HEIGHT_M, drive, settings};
use motorcade::{CameraCoupling, Config, GraphOptions, NoProgress, RunResult, Settings, estimate_drive};
use proptest::prelude::*;

fn run(frames: usize, factor: f64, camera: CameraCoupling) -> RunResult {
    let graph = GraphOptions { camera, ..GraphOptions::default() };
    let config = Config { graph, ..Config::default() };
    let settings = Settings { height_m: HEIGHT_M * factor, ..settings(config) };
    estimate_drive(drive(frames), &settings, &NoProgress)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn the_way_is_proportional_to_the_height_place_by_place(frames in 40_usize..90, factor in 0.9_f64..1.1) {
        let [right, wrong] = [1.0, factor].map(|f| run(frames, f, CameraCoupling::default()));
        prop_assert!(right.graph.is_some() && !right.vehicles.is_empty());
        for (a, b) in right.ego.frames.iter().zip(&wrong.ego.frames) {
            let (a, b) = (a.world_from_camera, b.world_from_camera);
            let off = (b.translation() - a.translation() * factor).norm();
            prop_assert!(off < 1e-9 * (1.0 + a.translation().norm()), "{off} m");
            prop_assert!(a.rotation().angle_to(&b.rotation()) < 1e-9);
        }
    }

    /// Vehicles, whose sizes do not grow with the height, may bend the trajectory a little otherwise, but stretch no step of it.
    #[test]
    fn a_way_that_bends_is_proportional_step_by_step(frames in 40_usize..90, factor in 0.9_f64..1.1) {
        let [right, wrong] = [1.0, factor].map(|f| run(frames, f, CameraCoupling::LengthsHeld));
        let steps = |r: &RunResult| -> Vec<f64> {
            let places: Vec<_> = r.ego.frames.iter().map(|f| f.world_from_camera.translation()).collect();
            places.windows(2).map(|w| (w[1] - w[0]).norm()).collect()
        };
        for (a, b) in steps(&right).iter().zip(steps(&wrong)) {
            prop_assert!((b / a / factor - 1.0).abs() < 1e-6, "{a} m {b} m");
        }
        prop_assert!((wrong.ego.length_m() / right.ego.length_m() / factor - 1.0).abs() < 1e-7);
    }
}

/// Nine cars, 1.5 m high, parked along the way.
const FRAMES: usize = 1350;

#[test]
fn an_unknown_height_is_estimated_by_cars() {
    let settings = Settings { height_m: 1.5, height_unknown: true, ..settings(Config::default()) };
    let found = estimate_drive(drive(FRAMES), &settings, &NoProgress);
    let way = (found.ego.length_m(), run(FRAMES, 1.0, CameraCoupling::default()).ego.length_m());
    let off = (found.ego.height_m / HEIGHT_M).ln();
    assert!(off.abs() < 0.12, "{} m", found.ego.height_m);
    assert!(((way.0 / way.1).ln() - off).abs() < 0.01, "{way:?}");
    let warning = found.warnings.iter().find(|w| w.contains("by the size of")).unwrap();
    assert!(warning.contains(&format!("{:.2} ±", found.ego.height_m)), "{warning}");
    // The way is as uncertain as the height.
    let last = found.ego.frames.last().unwrap();
    let (sigma_m, far_m) =
        (last.covariance.view((3, 3), (3, 3)).trace().sqrt(), last.world_from_camera.translation().norm());
    assert!((0.05..0.15).contains(&(sigma_m / far_m)), "{sigma_m} m of {far_m} m");
    assert!(off.abs() < 2.0 * sigma_m / far_m);
}

#[test]
fn a_height_that_cars_contradict_is_reported() {
    let doubts = |factor: f64| -> Vec<String> {
        let found = run(FRAMES, factor, CameraCoupling::default());
        found.warnings.into_iter().filter(|w| w.contains("disagrees with")).collect()
    };
    assert_eq!(doubts(1.0), Vec::<String>::new());
    assert_eq!(doubts(1.5).len(), 1);
}
