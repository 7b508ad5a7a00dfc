//! A break in the odometry: the map before and the map after have units of their own, and the road makes metres of both.

#![allow(clippy::unwrap_used, reason = "a test")]

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{
    EgoTrajectory, FrameRecord, FrameStatus, MetricOptions, Odometry, OdometryOptions, OdometryTrajectory,
    RoadMeasurement, RoadState, StaticMask,
};
use motorcade_testing::street_image::{CAMERA, StreetPose, street_image};
use nalgebra::{Matrix3, Matrix6, Vector6};

const HEIGHT_M: f64 = 1.6;
/// Frames of the break.
const BREAK: std::ops::Range<usize> = 60..85;
/// Units of the two maps \[m\].
const UNITS_M: [f64; 2] = [2.4, 0.7];

/// Speeds up from 7.5 m/s to 10 m/s during the break, in a gentle curvature.
fn truth(frames: usize) -> Vec<Pose<World, Camera>> {
    let mut poses = vec![Pose::identity()];
    for k in 1..frames {
        let done = (k as f64 - BREAK.start as f64) / BREAK.len() as f64;
        let speed = 7.5 + 2.5 * done.clamp(0.0, 1.0);
        let step = Pose::<Camera, Camera>::exp(&Vector6::new(0.0, 0.005, 0.0, 0.0, 0.0, 0.1 * speed));
        poses.push(poses[k - 1] * step);
    }
    poses
}

fn odometry(truth: &[Pose<World, Camera>]) -> OdometryTrajectory {
    let (mut frames, mut keyframes) = (Vec::new(), vec![Vec::new(), Vec::new()]);
    for (k, pose) in truth.iter().enumerate() {
        let segment = usize::from(k >= BREAK.end);
        // Both maps begin at their own first frame.
        let first = if segment == 0 { truth[0] } else { truth[BREAK.end] };
        let own: Pose<World, Camera> = (first.inverse() * *pose).cast();
        let lost = BREAK.contains(&k);
        if !lost {
            keyframes[segment].push(own.scaled(1.0 / UNITS_M[segment]).inverse());
        }
        frames.push(FrameRecord {
            timestamp_ns: k as i64 * 100_000_000,
            status: if lost { FrameStatus::Bridged } else { FrameStatus::Tracked },
            segment,
            keyframe: keyframes[segment].len() - 1,
            camera_from_keyframe: Pose::identity(),
            inliers: 100,
            rms_px: 0.3,
            covariance: Matrix6::identity() * 1e-8,
        });
    }
    OdometryTrajectory { frames: frames.into(), keyframes, measured_before_ns: None }
}

fn measurements(odometry: &OdometryTrajectory) -> Vec<RoadMeasurement> {
    let segment = |k: usize| odometry.frames[k].segment;
    let one = |k: usize| {
        let reference = k.checked_sub(2).filter(|r| segment(*r) == segment(k) && !BREAK.contains(r))?;
        if BREAK.contains(&k) {
            return None;
        }
        let pose = |k: usize| odometry.camera_from_world(k).unwrap();
        Some(RoadMeasurement {
            frame: k,
            reference,
            // The logarithm of one over the camera's height in the unit.
            state: RoadState {
                log_inverse_height: (UNITS_M[segment(k)] / HEIGHT_M).ln() + 0.01 * (k as f64).sin(),
                ..RoadState::default()
            },
            baseline: (pose(reference) * pose(k).inverse()).translation().norm(),
            covariance: Matrix3::identity() * 1e-5,
            curvature: None,
            agreement: 0.9,
            pixels: 4000,
        })
    };
    (0..odometry.frames.len()).filter_map(one).collect()
}

#[test]
fn a_break_costs_no_jump_of_scale() {
    let truth = truth(150);
    let odometry = odometry(&truth);
    let ego = EgoTrajectory::new(&odometry, &measurements(&odometry), HEIGHT_M, &MetricOptions::default());
    let own = |k: usize| ego.frames[k].world_from_camera.translation();
    let right = |k: usize| truth[k].translation();
    for k in 1..150 {
        let ratio = (own(k) - own(k - 1)).norm() / (right(k) - right(k - 1)).norm();
        // One per cent of noise in the road; the break itself by the speeds at its ends.
        assert!((ratio - 1.0).abs() < 0.02, "frame {k}: {ratio}");
    }
    let off = (own(149) - right(149)).norm();
    assert!(off < 1.5, "{off} m after 130 m");
    let sigma = |k: usize| ego.frames[k].covariance[(5, 5)].sqrt();
    assert!(sigma(90) > 2.0 * sigma(59), "a break is uncertain: {} m, {} m", sigma(59), sigma(90));
}

#[test]
fn a_window_that_begins_within_a_gap_knows_its_whole_time() {
    let mut whole = odometry(&truth(150));
    let measured = measurements(&whole);
    BREAK.for_each(|k| whole.frames[k] = FrameRecord::unplaced(k as i64 * 100_000_000));
    let options = MetricOptions::default();
    let ego = EgoTrajectory::new(&whole, &measured, HEIGHT_M, &options);
    let first = 70;
    let of_window = measured.iter().filter(|m| m.reference >= first);
    let shifted =
        of_window.map(|m| RoadMeasurement { frame: m.frame - first, reference: m.reference - first, ..*m });
    let shifted: Vec<RoadMeasurement> = shifted.collect();
    let window = EgoTrajectory::new(&whole.window(first..150), &shifted, HEIGHT_M, &options);
    for k in first + 1..BREAK.end {
        let sigma = |ego: &EgoTrajectory, k: usize| ego.frames[k].step_covariance[(1, 1)].sqrt();
        let (own, right) = (sigma(&window, k - first), sigma(&ego, k));
        assert!((own / right - 1.0).abs() < 1e-6 && own > 0.01, "frame {k}: {own}, {right}");
    }
    // While it lasts: the newest steps, one by one as they come, add up to what all of the gap is worth once it ends.
    let newest = |k: usize| {
        let window = EgoTrajectory::new(&whole.window(first - 40..k + 1), &[], HEIGHT_M, &options);
        window.frames.last().unwrap().step_covariance[(1, 1)]
    };
    // The last unseen step leads to the first frame of the next map.
    let sum = |of: &dyn Fn(usize) -> f64| (BREAK.start..BREAK.end + 1).map(of).sum::<f64>();
    let (one_by_one, at_once) = (sum(&newest), sum(&|k| ego.frames[k].step_covariance[(1, 1)]));
    assert!((one_by_one / at_once - 1.0).abs() < 0.01, "{one_by_one}, {at_once}");
}

/// Drives along a street; the road contradicts the unit in `contradicted`, given as it would be measured in a unit that shrank by half.
fn renewals(contradicted: std::ops::Range<usize>) -> (Vec<usize>, OdometryTrajectory) {
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    for frame in 0..90 {
        let image = street_image(&CAMERA, &StreetPose::along(0.8 * frame as f64));
        odometry.process(frame as i64 * 100_000_000, &image, &StaticMask::default());
        let wrong = if contradicted.contains(&frame) { 2.0_f64.ln() } else { 0.0 };
        let measured = RoadMeasurement {
            frame,
            reference: frame.saturating_sub(1),
            state: RoadState { log_inverse_height: wrong - 0.5, ..RoadState::default() },
            baseline: 0.5,
            covariance: Matrix3::identity() * 1e-4,
            curvature: None,
            agreement: 0.9,
            pixels: 4000,
        };
        if odometry.trajectory().frames[frame].status == FrameStatus::Tracked {
            odometry.constrain_scale(&measured);
        }
    }
    (odometry.renewals().to_vec(), odometry.finish())
}

#[test]
fn a_unit_that_the_road_contradicts_for_long_is_given_up() {
    // A false road of a second and a half changes nothing.
    let (renewed, trajectory) = renewals(30..45);
    assert!(renewed.is_empty() && trajectory.keyframes.len() == 1, "{renewed:?}");
    let (renewed, trajectory) = renewals(30..90);
    assert_eq!(renewed.len(), 1, "once: the new map has its own height");
    assert!((50..55).contains(&renewed[0]) && trajectory.keyframes.len() == 2, "{renewed:?}");
    let tracked = trajectory.frames[60..].iter().all(|f| f.status == FrameStatus::Tracked && f.segment == 1);
    assert!(tracked, "the new map goes on at once");
}
