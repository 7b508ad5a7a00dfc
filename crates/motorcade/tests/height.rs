//! A camera height that is wrong by some factor makes the camera's whole way longer by that factor, exactly, vehicles or not.

#![allow(clippy::unwrap_used, reason = "a test")]

mod common;

use common::{HEIGHT_M, drive};
use motorcade::{Config, Given, RunResult, Silent, conclude};
use proptest::prelude::*;

fn run(frames: usize, factor: f64) -> RunResult {
    conclude(drive(frames), &Given::default(), HEIGHT_M * factor, &Config::default(), 1, &Silent)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn lengths_are_proportional_to_the_height(frames in 40_usize..90, factor in 0.9_f64..1.1) {
        let (right, wrong) = (run(frames, 1.0), run(frames, factor));
        prop_assert!(right.graph.is_some() && !right.vehicles.is_empty());
        for (a, b) in right.ego.frames.iter().zip(&wrong.ego.frames) {
            let (a, b) = (a.world_from_camera, b.world_from_camera);
            let off = (b.translation() - a.translation() * factor).norm();
            prop_assert!(off < 1e-9 * (1.0 + a.translation().norm()), "{off} m");
            prop_assert!(a.rotation().angle_to(&b.rotation()) < 1e-9);
        }
    }
}
