//! The same drive at different frame rates gives the same trajectory, and its cost grows with the frames.

#![allow(clippy::unwrap_used, reason = "a test")]

use motorcade_odometry::{
    EgoTrajectory, FrameStatus, MetricOptions, Odometry, OdometryOptions, RoadFeedback, RoadInput,
    RoadOptions, RoadTracker, StaticMask,
};
use motorcade_testing::street_image::{CAMERA, HEIGHT_M, StreetPose, street_image};

/// Frames/s.
const RATES: [i64; 4] = [5, 10, 25, 50];
const NS: i64 = 1_000_000_000;

struct Run {
    ego: EgoTrajectory,
    measurements: usize,
    /// Time of the first measurement of the road \[s\].
    first_s: f64,
    keyframes: usize,
}

/// A drive of `seconds`; `along_m` gives the camera's position at a time \[s\].
fn drive(rate: i64, seconds: i64, along_m: impl Fn(f64) -> f64) -> Run {
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    let mut road = RoadTracker::new(CAMERA, RoadOptions::default());
    for frame in 0..=(rate * seconds) as usize {
        let timestamp_ns = frame as i64 * NS / rate;
        let image = street_image(&CAMERA, &StreetPose::along(along_m(timestamp_ns as f64 / NS as f64)));
        let pyramid = odometry.process(timestamp_ns, &image, &StaticMask::default());
        let trajectory = odometry.trajectory();
        let segment = trajectory.frames[frame].segment;
        let input =
            RoadInput { frame, timestamp_ns, segment, pyramid: &pyramid, vehicles: &[], masked: true };
        let measured = road.process(&input, |k| trajectory.measured_pose(k), |_| true);
        odometry.apply_road(&RoadFeedback {
            measurement: measured.as_ref(),
            plane: road.plane(),
            vehicles: &[],
        });
    }
    let keyframes = odometry.trajectory().keyframes.concat().len();
    assert_eq!(odometry.trajectory().keyframes.len(), 1, "{rate} frames/s: in one piece");
    let ego =
        EgoTrajectory::new(&odometry.finish(), road.measurements(), HEIGHT_M, &MetricOptions::default());
    let first_s = road.measurements()[0].frame as f64 / rate as f64;
    Run { ego, measurements: road.measurements().len(), first_s, keyframes }
}

/// Position along the street at the frame of a time \[m\], and its standard deviation.
fn along(run: &Run, rate: i64, second: i64) -> (f64, f64) {
    let frame = &run.ego.frames[(rate * second) as usize];
    (frame.world_from_camera.translation().z, frame.covariance[(5, 5)].sqrt())
}

#[test]
fn trajectories_covariances_and_measurements_agree_at_all_rates() {
    let (seconds, speed_mps) = (6, 8.0);
    let mut sigmas = Vec::new();
    for rate in RATES {
        let run = drive(rate, seconds, |t| speed_mps * t);
        for second in 2..=seconds {
            let (found, _) = along(&run, rate, second);
            let truth = speed_mps * second as f64;
            assert!((found / truth - 1.0).abs() < 0.015, "{rate} frames/s, {second} s: {found} of {truth} m");
        }
        sigmas.push(along(&run, rate, seconds).1);
        // Frames before the map are compared once they have poses: few a second need no longer than many.
        assert!(run.first_s <= 0.61, "{rate} frames/s: first measured after {} s", run.first_s);
        // Five to thirteen alignments a second, and keyframes by distance, at any rate.
        let per_second = run.measurements as f64 / seconds as f64;
        assert!((3.0..13.0).contains(&per_second), "{rate} frames/s: {per_second} measurements/s");
        assert!((6..=60).contains(&run.keyframes), "{rate} frames/s: {} keyframes", run.keyframes);
    }
    let least = sigmas.iter().copied().fold(f64::INFINITY, f64::min);
    let most = sigmas.iter().copied().fold(0.0, f64::max);
    assert!(most < 2.0 * least, "standard deviations at the end {sigmas:?}");
}

/// Half a walking pace moves the image by less than the limit of the standstill test per frame at 25 frames/s.
#[test]
fn a_slow_car_does_not_stand_and_a_standing_one_does() {
    for rate in RATES {
        // Drives two seconds, stands one, creeps two.
        let position = |t: f64| 6.0 * t.min(2.0) + 0.5 * (t - 3.0).max(0.0);
        let run = drive(rate, 5, position);
        let status = |from: i64, to: i64| {
            let frames = &run.ego.frames[(from * rate / 10) as usize..(to * rate / 10) as usize];
            let standing = frames.iter().filter(|f| f.status == FrameStatus::Standstill).count();
            standing as f64 / frames.len() as f64
        };
        assert!(status(24, 30) > 0.6, "{rate} frames/s: {} of the stop recognised", status(24, 30));
        let crept = along(&run, rate, 5).0 - along(&run, rate, 3).0;
        assert!((crept - 1.0).abs() < 0.15, "{rate} frames/s: crept {crept} m of 1 m");
    }
}

/// Frames that are missing change the interval, not the speed.
#[test]
fn unequal_intervals_are_predicted_by_time() {
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    let mut times_s = vec![0.0];
    let intervals_s = [0.1, 0.1, 0.1, 0.2, 0.05, 0.1, 0.15, 0.05, 0.1, 0.2, 0.1];
    for k in 0..40 {
        times_s.push(times_s[k] + intervals_s[k % intervals_s.len()]);
    }
    for t in &times_s {
        odometry.process(
            (t * NS as f64) as i64,
            &street_image(&CAMERA, &StreetPose::along(8.0 * t)),
            &StaticMask::default(),
        );
    }
    let trajectory = odometry.finish();
    assert_eq!(trajectory.keyframes.len(), 1);
    let z = |k: usize| trajectory.camera_from_world(k).unwrap().inverse().translation().z;
    let unit = 8.0 * times_s[40] / z(40);
    for (k, t) in times_s.iter().enumerate().skip(1) {
        assert!(
            (z(k) * unit - 8.0 * t).abs() < 0.02 * 8.0 * t + 0.05,
            "frame {k}: {} of {}",
            z(k) * unit,
            8.0 * t
        );
    }
}
