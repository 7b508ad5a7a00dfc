//! A trajectory of unknown unit without pictures: cars that stand beside the road give its metres, through the whole pipeline.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test")]

use crate::common::{CAMERA, HEIGHT_M};
use motorcade::{External, ExternalTrajectory, FrameInfo, Motorcade, NoProgress, RunResult};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_perception::{BoxConvention, Detection, Observations, VehicleClass};
use motorcade_vehicles::{Dimensions, image_box, upright_pose};
use nalgebra::{Point3, UnitQuaternion, Vector3};

const FRAMES: usize = 160;
const PARKED_SIZE: Dimensions = Dimensions { length_m: 4.3, width_m: 1.75, height_m: 1.5 };

/// A car `ahead` metres before the camera and `right` beside it.
fn boxed(right: f64, ahead: f64) -> Option<Detection> {
    let pose = upright_pose(&Point3::new(right, HEIGHT_M, ahead), &Vector3::z(), &-Vector3::y());
    let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
    let whole =
        (ahead > 6.0).then(|| image_box(&CAMERA, &pose, class, convention, &PARKED_SIZE)).flatten()?;
    let bbox = whole.clipped(CAMERA.width, CAMERA.height);
    let seen = bbox.width() > 8.0 && bbox.height() > 12.0;
    seen.then_some(Detection {
        bbox,
        score: 0.9,
        class,
        convention,
        external_id: None,
        pixel_size: 1.0,
        road_below: None,
    })
}

/// A straight road at 10 m/s behind another car; a car is parked at the right every 35 m, where there are any. A unit of the
/// trajectory is so many metres.
fn drive(unit_m: f64, parked: bool, online: bool) -> RunResult {
    let seen = |k: usize| {
        let spots = (0..8).filter(|_| parked).map(|spot| (4.5, 30.0 + 35.0 * f64::from(spot) - k as f64));
        let in_view = spots.filter(|(_, ahead)| *ahead < 60.0);
        std::iter::once((0.0, 16.0)).chain(in_view).filter_map(|(right, ahead)| boxed(right, ahead)).collect()
    };
    let at = |k: usize| Vector3::z() * (k as f64 / unit_m);
    let camera = |k: usize| -> Pose<World, Camera> { Pose::from_parts(UnitQuaternion::identity(), at(k)) };
    let frame =
        |k: usize| FrameInfo { number: k as u64, timestamp_ns: k as i64 * 100_000_000, problem: None };
    let trajectory =
        ExternalTrajectory { world_from_camera: (0..FRAMES).map(camera).collect(), metric: false };
    let external = External { trajectory: Some(trajectory), ..External::default() };
    let builder = Motorcade::builder(CAMERA).height_m(HEIGHT_M).external(external);
    let mut slam = builder.build().unwrap();
    for k in 0..FRAMES {
        let observations = Observations { detections: seen(k), ..Observations::default() };
        slam.push_without_image(frame(k), observations).unwrap();
    }
    if online { slam.finish_online(&NoProgress) } else { slam.finish() }
}

#[test]
fn parked_cars_give_the_metres_whatever_the_unit() {
    let way_m = (FRAMES - 1) as f64;
    let lengths = [0.4, 1.0, 20.0].map(|unit_m| {
        let result = drive(unit_m, true, false);
        assert!(result.warnings.iter().any(|w| w.contains("vehicles then stand")), "{:?}", result.warnings);
        // A tenth is stated: what all boxes have in common.
        assert!(result.ego.frames.iter().all(|f| f.scale_bias_sigma > 0.09));
        result.ego.length_m()
    });
    println!("{lengths:.1?} m of {way_m}");
    for length_m in lengths {
        assert!((length_m / way_m - 1.0).abs() < 0.08, "{lengths:?}");
        assert!((length_m / lengths[0] - 1.0).abs() < 1e-6, "{lengths:?}");
    }
}

#[test]
fn traffic_that_moves_gives_no_metres_and_the_run_says_so() {
    let result = drive(3.0, false, false);
    assert!(!result.warnings.iter().any(|w| w.contains("vehicles then stand")), "{:?}", result.warnings);
    assert!(result.warnings.iter().any(|w| w.contains("scale is a guess")), "{:?}", result.warnings);
}

/// Online the unit is known once three parked cars have been seen, and holds from then on.
#[test]
fn parked_cars_give_the_unit_online_too() {
    let recorded = drive(3.0, true, true);
    assert!(recorded.warnings.iter().any(|w| w.contains("vehicles then stand")), "{:?}", recorded.warnings);
    let at = |k: usize| recorded.ego.frames[k].world_from_camera.translation();
    let last_m = (at(FRAMES - 1) - at(FRAMES - 41)).norm();
    assert!((last_m / 40.0 - 1.0).abs() < 0.1, "{last_m} m of 40 m");
}
