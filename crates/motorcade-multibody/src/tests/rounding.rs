//! Covariances of long drives are not lost in rounding: with the elimination order of the solver the variances here reach 1e122 m².

use std::ops::Range;

use super::*;

const SECONDS: usize = 15;
const FPS: usize = 25;
const SPEED_MPS: f64 = 34.0;

/// Cars 20 m ahead of a fast camera whose scale is guessed, each seen in the given share of the frames: lengths of steps are free, rotations are held.
fn motorway(seen_shares: &[Range<f64>]) -> (EgoTrajectory, Vec<VehicleTrajectory>, Vec<f64>) {
    let times_s: Vec<f64> = (0..SECONDS * FPS).map(|k| k as f64 / FPS as f64).collect();
    let at = |time_s: f64| Vector3::new(0.0, 0.0, SPEED_MPS * time_s);
    let cameras: Vec<Pose<World, Camera>> =
        times_s.iter().map(|t| Pose::from_parts(UnitQuaternion::identity(), at(*t))).collect();
    let timestamps_ns: Vec<i64> = times_s.iter().map(|t| (t * 1e9).round() as i64).collect();
    let odometry =
        OdometryTrajectory::from_poses(&cameras, &timestamps_ns, &ExternalTrajectoryOptions::default());
    let mut ego = EgoTrajectory::metric(&odometry, &[], CAMERA_HEIGHT_M, 0.0, &MetricOptions::default());
    for (k, frame) in ego.frames.iter_mut().enumerate() {
        let step_m = SPEED_MPS / FPS as f64;
        frame.step_measured = k > 0;
        frame.scale_sigma = 0.35;
        frame.step_covariance =
            Matrix6::from_diagonal(&Vector6::new(1e-8, 1e-8, 1e-8, 1e-6, 1e-6, (0.35 * step_m).powi(2)));
        frame.covariance = Matrix6::zeros();
    }
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut normal = move || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    let mut vehicles = Vec::new();
    for (lane, share) in seen_shares.iter().enumerate() {
        let truth = |k: usize| on_road(3.5 * lane as f64, 20.0 + SPEED_MPS * times_s[k], 0.0);
        let car = VehicleTrajectory { id: lane, ..vehicle(truth, |_| Vec::new(), 1.0) };
        let state = car.states[0].clone();
        let mut of_frame = |frame: usize| VehicleState {
            frame,
            world_from_vehicle: truth(frame),
            observations: vec![PoseObservation {
                camera_from_vehicle: (cameras[frame].inverse() * truth(frame))
                    .retract(&sigmas().map(|s| s * normal())),
                scale_derivative: Vector6::new(0.0, 0.0, 0.0, 20.0, 0.0, 0.0),
                ..seen(Source::Box, &truth(0), 0, &Vector6::zeros())
            }],
            ..state.clone()
        };
        let [first, end] = [share.start, share.end].map(|s| (s * times_s.len() as f64) as usize);
        vehicles.push(VehicleTrajectory { states: (first..end).map(&mut of_frame).collect(), ..car });
    }
    (ego, vehicles, times_s)
}

#[test]
fn covariances_of_a_long_drive_are_not_lost_in_rounding() {
    // The sizes of several cars join frames that are far apart: no cut runs between frames.
    let all = 0.0..1.0;
    for shares in [vec![all.clone()], vec![all.clone(), all, 0.0..0.2, 0.15..0.35, 0.4..0.6, 0.55..0.8]] {
        let (mut ego, mut vehicles, times_s) = motorway(&shares);
        let mut graph = MultibodyGraph::drive(&GraphOptions::default(), 1).unwrap();
        let frames = WindowFrames { first: 0, times_s: &times_s };
        graph.update(&frames, &mut ego, &mut vehicles).unwrap();
        for vehicle in &vehicles {
            for state in &vehicle.states {
                let [forward, left, up] = [3, 4, 5].map(|k| state.covariance[(k, k)].sqrt());
                let plausible =
                    (0.5..1.2).contains(&forward) && (0.1..0.4).contains(&left) && (0.03..0.2).contains(&up);
                assert!(plausible, "car {}, frame {}: {forward} {left} {up} m", vehicle.id, state.frame);
            }
        }
    }
}
