//! Vehicles in the earlier picture are not compared with the road.

use image::{GrayImage, Luma};
use motorcade_geometry::robust::median;
use motorcade_geometry::{BoundingBox, Camera, Pose, World};
use motorcade_odometry::{
    ExternalTrajectoryOptions, OdometryTrajectory, ProfileOptions, Pyramid, RoadInput, RoadMeasurement,
    RoadOptions, RoadTracker,
};
use motorcade_testing::street_image::{CAMERA, HEIGHT_M, StreetPose, street_image};
use nalgebra::{Isometry3, Point2};
use std::sync::Arc;

const FRAMES: usize = 30;
const TIMES_NS: [i64; FRAMES] = {
    let mut times = [0; FRAMES];
    let mut k = 0;
    while k < FRAMES {
        times[k] = k as i64 * 100_000_000;
        k += 1;
    }
    times
};
/// Distance between two frames, in the odometry's unit and in metres.
const STEP_M: f64 = 1.0;
/// A crossing car in two frames of four: it hides road in the earlier picture that is visible in the later one \[px\].
const CROSSING: BoundingBox = BoundingBox { x1: 150.0, y1: 95.0, x2: 330.0, y2: 165.0 };

fn crosses(frame: usize) -> bool {
    frame % 4 < 2
}

fn picture(frame: usize) -> GrayImage {
    let mut image = street_image(&CAMERA, &StreetPose::along(STEP_M * frame as f64));
    let inside = |x: u32, y: u32| CROSSING.contains(f64::from(x), f64::from(y));
    for (x, y, grey) in image.enumerate_pixels_mut().filter(|(x, y, _)| crosses(frame) && inside(*x, *y)) {
        // Dark, brighter towards the roof.
        *grey = Luma([20 + (165 - y.min(165)) as u8 + (x % 7) as u8]);
    }
    image
}

/// Tracks the road in pictures one step apart; measured over true height by frame.
fn heights(boxes: &[BoundingBox], picture: impl Fn(usize) -> GrayImage) -> Vec<(usize, f64)> {
    let pose = |k: usize| Pose::<World, Camera>::new(Isometry3::translation(0.0, 0.0, STEP_M * k as f64));
    let poses: Vec<_> = (0..FRAMES).map(pose).collect();
    let odometry = OdometryTrajectory::from_poses(&poses, &TIMES_NS, &ExternalTrajectoryOptions::default());
    let mut road = RoadTracker::new(CAMERA, RoadOptions::default());
    for frame in 0..FRAMES {
        let pyramid = Arc::new(Pyramid::new(&picture(frame), 3));
        let vehicles = if crosses(frame) { boxes } else { &[] };
        let timestamp_ns = TIMES_NS[frame];
        let input = RoadInput { frame, timestamp_ns, segment: 0, pyramid: &pyramid, vehicles, masked: true };
        let usable = |p: &Point2<f64>| !vehicles.iter().any(|v| v.contains(p.x, p.y));
        road.process(&input, |k| odometry.camera_from_world(k), usable);
    }
    let height = |m: &RoadMeasurement| {
        (m.frame, m.corrected(&odometry, &ProfileOptions::default()).state.height() / HEIGHT_M)
    };
    let heights: Vec<_> = road.measurements().iter().map(height).collect();
    assert!(heights.len() > FRAMES / 3, "{} measurements", heights.len());
    heights
}

/// Median error of the camera's height over the drive, as a share.
fn error(boxes: &[BoundingBox]) -> f64 {
    let mut errors: Vec<f64> = heights(boxes, picture).iter().map(|(_, h)| (h - 1.0).abs()).collect();
    median(&mut errors).unwrap_or(f64::NAN)
}

#[test]
fn a_plane_that_drifts_away_is_rejected() {
    // From frame 12 on the road seems to go by faster, by a thirtieth more every frame: no step is too large, all of them are.
    let seems = |frame: usize| 1.0 + 0.033 * frame.saturating_sub(12) as f64;
    let way_m = |frame: usize| (1..=frame).map(|k| STEP_M * seems(k)).sum::<f64>();
    let found = heights(&[], |frame| street_image(&CAMERA, &StreetPose::along(way_m(frame))));
    let lowest = found.iter().map(|(_, h)| *h).fold(f64::INFINITY, f64::min);
    // Without an anchor it would be followed to 1/1.5.
    assert!(lowest > 0.7 && found.iter().any(|(k, h)| *k > 14 && *h < 0.95), "{found:?}");
}

#[test]
fn a_vehicle_in_the_earlier_picture_does_not_tip_the_road() {
    let (masked, unmasked) = (error(&[CROSSING]), error(&[]));
    assert!(masked < 0.002, "{masked}");
    assert!(unmasked > 1.4 * masked, "the car is no test: {unmasked} against {masked}");
}
