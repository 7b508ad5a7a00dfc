//! Exact tracks of drives, adjusted with a wrong lens.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Point2, Point3, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::adjustment::Adjustment;
use crate::estimate::LensEstimate;
use crate::lens::Lens;
use crate::options::CalibrateOptions;
use crate::prior::LensPrior;
use crate::tracks::{MapTracks, Track};
use crate::window::Window;

const SIZE: (u32, u32) = (1242, 375);

/// Keyframes 1 m apart; the camera turns at `turn` \[rad/m\] in the middle third.
fn drive(turn: f64) -> Vec<Pose<Camera, World>> {
    let mut world_from_camera = Pose::<World, Camera>::identity();
    let mut poses = Vec::new();
    for k in 0..36 {
        poses.push(world_from_camera.inverse());
        let rate = if (12..24).contains(&k) { turn } else { 0.0 };
        world_from_camera = world_from_camera.retract(&Vector6::new(0.0, rate, 0.0, 0.0, 0.0, 1.0));
    }
    poses
}

/// Tracks of random points through a lens with 0.15 px of noise.
fn tracks(poses: &[Pose<Camera, World>], lens: &Lens) -> MapTracks {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut tracks = Vec::new();
    while tracks.len() < 700 {
        let from = poses[rng.random_range(0..poses.len())].inverse();
        let (x, y) = (rng.random_range(-0.85..0.85), rng.random_range(-0.25..0.25));
        let depth = 1.0 / rng.random_range(0.002..0.15_f64);
        let point = from.transform_point(&Point3::from(Vector3::new(x, y, 1.0) * depth));
        let seen = poses.iter().enumerate().filter_map(|(k, pose)| {
            let pixel = lens.project(&pose.transform_point(&point).coords)?.pixel;
            let inside =
                (0.0..f64::from(SIZE.0)).contains(&pixel.x) && (0.0..f64::from(SIZE.1)).contains(&pixel.y);
            inside.then_some((k, pixel))
        });
        let track: Track = seen
            .map(|(k, p)| {
                (k, Point2::new(p.x + rng.random_range(-0.26..0.26), p.y + rng.random_range(-0.26..0.26)))
            })
            .collect();
        if track.len() >= 3 {
            tracks.push(track);
        }
    }
    MapTracks { poses: poses.to_vec(), tracks }
}

/// The same drive as an odometry with a focal length wrong by `factor` sees it: turns are larger or smaller.
fn adjusted(turn: f64, truth: &Lens, factor: f64) -> LensEstimate {
    let map = MapTracks { poses: drive(turn / factor), ..tracks(&drive(turn), truth) };
    let start = Lens::centred(truth.focal_px * factor, SIZE.0, SIZE.1);
    let mut options = CalibrateOptions::default();
    options.advanced.common_focal_sigma = 0.0;
    let windows = vec![Window::new(&map, 0..map.poses.len(), &start, 50).unwrap()];
    let mut adjustment = Adjustment { lens: start, windows };
    let prior = LensPrior::new(start, [0.5, options.k1_sigma], SIZE.0, &options);
    adjustment.solve(&prior, &options);
    LensEstimate::new(&adjustment, &prior, &options)
}

#[test]
fn a_turn_determines_the_focal_length() {
    let truth = Lens { cx: 612.0, cy: 180.0, ..Lens::centred(720.0, SIZE.0, SIZE.1) };
    for factor in [0.75, 1.3] {
        let found = adjusted(0.08, &truth, factor);
        let error = (found.lens.focal_px / truth.focal_px).ln();
        assert!(error.abs() < 0.025 && error.abs() < 3.0 * found.focal_sigma(), "{factor}: {found:?}");
        assert!(found.focal_sigma() < 0.02 && found.lens.k1.abs() < 0.02, "{factor}: {found:?}");
    }
}

#[test]
fn distortion_is_seen() {
    let truth = Lens { k1: -0.25, ..Lens::centred(720.0, SIZE.0, SIZE.1) };
    let found = adjusted(0.03, &truth, 1.15);
    assert!((found.lens.k1 + 0.25).abs() < 0.03, "{found:?}");
    assert!((found.lens.focal_px / truth.focal_px).ln().abs() < 0.02, "{found:?}");
}

#[test]
fn straight_motion_determines_no_focal_length() {
    let truth = Lens::centred(720.0, SIZE.0, SIZE.1);
    let found = adjusted(0.0, &truth, 1.3);
    assert!(found.focal_sigma() > CalibrateOptions::default().most_focal_sigma, "{found:?}");
}
