//! A map is initialised within a second of driving, straight on or in a turn, and not before the car drives.

use image::{GrayImage, Luma};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{
    EgoTrajectory, FrameStatus, MetricOptions, Odometry, OdometryOptions, OdometryTrajectory, StaticMask,
};
use motorcade_testing::street_image::{CAMERA, StreetPose, street_image};
use nalgebra::Vector6;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One second.
const SECOND: usize = 10;
/// 36 km/h.
const STRAIGHT: (f64, f64) = (1.0, 0.0);
/// 22 km/h and 12° a second: around a corner.
const TURN: (f64, f64) = (0.6, 0.021);
const STANDING: (f64, f64) = (0.0, 0.0);

/// Positions of the camera after each step `(distance [m], turn [rad])`, starting with the first.
fn street_poses(steps: &[(f64, f64)]) -> Vec<StreetPose> {
    let mut pose = StreetPose::default();
    let mut street_poses = vec![pose];
    for (distance_m, turn_rad) in steps {
        pose.heading_rad += turn_rad;
        pose.across_m += distance_m * pose.heading_rad.sin();
        pose.along_m += distance_m * pose.heading_rad.cos();
        street_poses.push(pose);
    }
    street_poses
}

fn world_from_camera(pose: &StreetPose) -> Pose<World, Camera> {
    let shift = Pose::<World, Camera>::exp(&Vector6::new(0.0, 0.0, 0.0, pose.across_m, 0.0, pose.along_m));
    shift * Pose::<Camera, Camera>::exp(&Vector6::new(0.0, pose.heading_rad, 0.0, 0.0, 0.0, 0.0))
}

/// The street with a sensor's noise of two grey levels.
fn noisy(pose: &StreetPose, rng: &mut ChaCha8Rng) -> GrayImage {
    let mut image = street_image(&CAMERA, pose);
    for Luma([grey]) in image.pixels_mut() {
        *grey = grey.saturating_add_signed(rng.random_range(-2..=2));
    }
    image
}

/// Frame at which the map was initialised, and the odometry.
fn drive(steps: &[(f64, f64)], options: OdometryOptions) -> (Option<usize>, OdometryTrajectory) {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut odometry = Odometry::new(CAMERA, options);
    let mut began = None;
    for (frame, pose) in street_poses(steps).iter().enumerate() {
        odometry.process(frame as i64 * 100_000_000, &noisy(pose, &mut rng), &StaticMask::default());
        if began.is_none() && !odometry.trajectory().keyframes.is_empty() {
            began = Some(frame);
        }
    }
    (began, odometry.finish())
}

fn poses(odometry: &OdometryTrajectory) -> Vec<Pose<World, Camera>> {
    (0..odometry.frames.len()).filter_map(|k| Some(odometry.camera_from_world(k)?.inverse())).collect()
}

/// Fails where the distance from the first frame is off by a fiftieth, in the unit that fits the last frame, or the heading by
/// two pixels.
fn follows(found: &[Pose<World, Camera>], steps: &[(f64, f64)]) {
    let truth: Vec<_> = street_poses(steps).iter().map(world_from_camera).collect();
    assert_eq!(found.len(), truth.len(), "every frame has a pose");
    let last = truth.len() - 1;
    let unit = truth[last].translation().norm() / found[last].translation().norm();
    for (frame, (own, right)) in found.iter().zip(&truth).enumerate().skip(1) {
        let (off, way) =
            ((own.translation() * unit - right.translation()).norm(), right.translation().norm());
        assert!(off < 0.02 * way, "frame {frame}: {off} m off after {way} m");
        let turned_rad = (own.inverse() * *right).log().fixed_rows::<3>(0).norm();
        assert!(turned_rad * CAMERA.focal_px() < 2.0, "frame {frame}: {turned_rad} rad off");
    }
}

#[test]
fn initialises_within_a_second_of_driving() {
    for pace in [STRAIGHT, TURN] {
        let steps = [pace; 2 * SECOND];
        let (began, odometry) = drive(&steps, OdometryOptions::default());
        assert!(began.is_some_and(|frame| frame <= SECOND), "{pace:?}: {began:?}");
        assert_eq!(odometry.keyframes.len(), 1, "{pace:?}: in one piece");
        follows(&poses(&odometry), &steps);
    }
}

/// The test above can fail: with ten times the parallax required a second is too short.
#[test]
fn waits_for_the_required_parallax() {
    let mut options = OdometryOptions::default();
    options.advanced.policy.begin_flow_rad *= 10.0;
    let (began, _) = drive(&[STRAIGHT; SECOND], options);
    assert_eq!(began, None);
}

#[test]
fn waits_at_standstill_and_initialises_within_a_second_of_driving() {
    let standing = 2 * SECOND;
    let steps = [[STANDING; SECOND], [STANDING; SECOND], [STRAIGHT; SECOND]].concat();
    let (began, odometry) = drive(&steps, OdometryOptions::default());
    assert!(began.is_some_and(|frame| frame > standing && frame <= standing + SECOND), "{began:?}");
    let poses = poses(&odometry);
    assert_eq!(poses.len(), steps.len() + 1, "every frame has a pose");
    let step = (poses[standing + 2].translation() - poses[standing + 1].translation()).norm();
    for (frame, pose) in poses.iter().enumerate().take(standing + 1) {
        let crept = pose.translation().norm();
        assert!(crept < 0.02 * step, "frame {frame}: {crept} of a step of {step}");
    }
}

#[test]
fn the_pose_is_kept_at_standstill() {
    let (stop, start) = (2 * SECOND, 3 * SECOND);
    let steps = [[STRAIGHT; SECOND], [STRAIGHT; SECOND], [STANDING; SECOND], [STRAIGHT; SECOND]].concat();
    let (_, odometry) = drive(&steps, OdometryOptions::default());
    let poses = poses(&odometry);
    assert_eq!(odometry.keyframes.len(), 1, "in one piece");
    for frame in stop + 1..=start {
        assert_eq!(odometry.frames[frame].status, FrameStatus::Standstill, "frame {frame}");
        let crept = (poses[frame].translation() - poses[stop].translation()).norm();
        assert!(crept < 1e-9 * poses[stop].translation().norm(), "frame {frame}: {crept}");
    }
    follows(&poses, &steps);
}

/// Frames that show nothing of the motion: the camera may drive as fast as traffic does, and for all of them at the same speed.
#[test]
fn a_motion_that_was_never_measured_is_as_uncertain_as_traffic() {
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    (0..4).for_each(|k| odometry.skip(k * 200_000_000));
    let options = MetricOptions::default();
    let ego = EgoTrajectory::new(&odometry.finish(), &[], 1.65, &options);
    let along = |k: usize| ego.frames[k].covariance[(5, 5)].sqrt();
    assert!(along(0) < 0.2, "{}", along(0));
    for k in 1..4 {
        let expected = options.unknown_speed_sigma_mps * 0.2 * k as f64;
        assert!((along(k) / expected - 1.0).abs() < 0.02, "{k}: {}, expected {expected}", along(k));
    }
}
