//! The same motion at other frame rates, and at unequal intervals, gives the same estimates.

use super::*;

/// Base of all rates \[s\], and seconds of the drive.
const TICK_S: f64 = 0.02;
const SECONDS: f64 = 8.0;

/// The camera, 10 m/s straight on.
fn camera_at(time_s: f64) -> Pose<World, Camera> {
    Pose::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, 10.0 * time_s))
}

/// A car ahead that brakes, accelerates and changes lanes, integrated in fine steps; one pose a tick.
fn car() -> Vec<Pose<World, Vehicle>> {
    let (fine, mut x, mut z) = (20, 0.0, 18.0);
    let mut out = Vec::new();
    let dt = TICK_S / f64::from(fine);
    for k in 0..=(SECONDS / TICK_S).round() as i32 {
        let heading = |t: f64| 0.12 * (0.9 * t).sin();
        out.push(on_road(x, z, heading(f64::from(k) * TICK_S)));
        for i in 0..fine {
            let t = f64::from(k) * TICK_S + (f64::from(i) + 0.5) * dt;
            let speed = 10.0 + 1.5 * (0.7 * t).sin();
            x -= speed * heading(t).sin() * dt;
            z += speed * heading(t).cos() * dt;
        }
    }
    out
}

/// Errors of measurements (6, `[ω, ν]`), one a tick: correlated exponentially, so that the variance of a mean over T is that
/// of one measurement times 0.4 s / T, the correlation time of the default options.
fn errors(seed: u64) -> Vec<Vector6<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    let keep = (-TICK_S / 0.2_f64).exp();
    let mut error = sigmas().map(|s| s * normal());
    let mut next = || {
        error = error * keep + sigmas().map(|s| s * normal()) * (1.0 - keep * keep).sqrt();
        error
    };
    (0..=(SECONDS / TICK_S).round() as usize).map(|_| next()).collect()
}

/// A drive seen at some ticks: camera, vehicle, times.
fn seen_at(ticks: &[usize], seed: u64) -> (EgoTrajectory, VehicleTrajectory, Vec<f64>) {
    let (truth, errors) = (car(), errors(seed));
    let times_s: Vec<f64> = ticks.iter().map(|t| *t as f64 * TICK_S).collect();
    let cameras: Vec<_> = times_s.iter().map(|t| camera_at(*t)).collect();
    let timestamps_ns: Vec<i64> = times_s.iter().map(|t| (t * 1e9).round() as i64).collect();
    let odometry =
        OdometryTrajectory::from_poses(&cameras, &timestamps_ns, &ExternalTrajectoryOptions::default());
    let options = MetricOptions::default();
    let mut ego = EgoTrajectory::metric(&odometry, &[], CAMERA_HEIGHT_M, 0.0, &options);
    for frame in &mut ego.frames {
        // Of the covariance of a vehicle only the part of the graph is compared.
        frame.covariance = Matrix6::zeros();
    }
    let mut vehicle = vehicle(|_| truth[0], |_| Vec::new(), 1.0);
    vehicle.states.truncate(1);
    let state = vehicle.states[0].clone();
    vehicle.states = ticks
        .iter()
        .enumerate()
        .map(|(frame, tick)| {
            let observation = PoseObservation {
                camera_from_vehicle: (cameras[frame].inverse() * truth[*tick]).retract(&errors[*tick]),
                ..seen(Source::External, &truth[0], 0, &Vector6::zeros())
            };
            VehicleState {
                frame,
                world_from_vehicle: truth[*tick],
                observations: vec![observation],
                heading_variance: 0.0,
                rival: None,
                ..state.clone()
            }
        })
        .collect();
    (ego, vehicle, times_s)
}

/// Root mean square error of the position \[m\], and root mean square standard deviation \[m\].
#[derive(Clone, Copy, Debug, Default)]
struct Accuracy {
    error_m: f64,
    sigma_m: f64,
}

impl Accuracy {
    /// Of states a second away from the ends.
    fn of<'a>(states: impl Iterator<Item = (&'a VehicleState, f64, usize)>) -> Self {
        let (truth, mut sums, mut count) = (car(), [0.0; 2], 0.0);
        for (state, _, tick) in states.filter(|(_, t, _)| (1.0..SECONDS - 1.0).contains(t)) {
            let off = state.world_from_vehicle.translation() - truth[tick].translation();
            sums[0] += off.norm_squared();
            sums[1] += state.covariance.fixed_view::<3, 3>(3, 3).trace();
            count += 1.0;
        }
        let [error_m, sigma_m] = sums.map(|sum: f64| (sum / count).sqrt());
        Self { error_m, sigma_m }
    }

    fn mean(all: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        Self { error_m: mean(|a| a.error_m), sigma_m: mean(|a| a.sigma_m) }
    }

    fn is_like(self, other: Self) -> bool {
        let alike = |a: f64, b: f64| a < 1.3 * b && b < 1.3 * a;
        self.error_m < 1.3 * other.error_m && alike(self.sigma_m, other.sigma_m)
    }
}

fn every(ticks: usize) -> Vec<usize> {
    (0..=(SECONDS / TICK_S).round() as usize).step_by(ticks).collect()
}

fn whole_drive(ticks: &[usize]) -> Accuracy {
    let one = |seed: u64| {
        let (mut ego, mut vehicle, times_s) = seen_at(ticks, seed);
        let mut graph = MultibodyGraph::drive(&GraphOptions::default(), 1).unwrap();
        let frames = WindowFrames { first: 0, times_s: &times_s };
        graph.update(&frames, &mut ego, std::slice::from_mut(&mut vehicle)).unwrap();
        let states = vehicle.states.iter();
        Accuracy::of(states.map(|s| (s, times_s[s.frame], ticks[s.frame])))
    };
    Accuracy::mean(&[31, 32, 33, 34, 35, 36].map(one))
}

/// Every frame as the newest of a window of 2.5 s.
fn online(ticks: &[usize]) -> Accuracy {
    let one = |seed: u64| {
        let (ego, vehicle, times_s) = seen_at(ticks, seed);
        let mut graph = MultibodyGraph::sliding(&GraphOptions::default(), 8).unwrap();
        let mut newest = Vec::new();
        for end in 1..=ticks.len() {
            let first = times_s.partition_point(|t| times_s[end - 1] - t > 2.5 - 1e-6);
            let (mut ego, mut vehicle) = (ego.clone(), vehicle.clone());
            ego.frames = ego.frames[first..end].to_vec();
            vehicle.states = vehicle.states[first..end].to_vec();
            vehicle.states.iter_mut().for_each(|s| s.frame -= first);
            let frames = WindowFrames { first, times_s: &times_s[first..end] };
            graph.update(&frames, &mut ego, std::slice::from_mut(&mut vehicle)).unwrap();
            newest.extend(vehicle.states.pop());
        }
        let rows = newest.iter().enumerate();
        Accuracy::of(rows.map(|(k, s)| (s, times_s[k], ticks[k])))
    };
    Accuracy::mean(&[41, 42].map(one))
}

#[test]
fn the_drive_is_the_same_at_5_to_50_frames_a_second() {
    let [two, five, ten, twenty_five, fifty] = [25, 10, 5, 2, 1].map(|ticks| whole_drive(&every(ticks)));
    println!("2: {two:?}\n5: {five:?}\n10: {ten:?}\n25: {twenty_five:?}\n50: {fifty:?}");
    for other in [five, twenty_five, fifty] {
        assert!(other.is_like(ten), "{other:?} {ten:?}");
    }
    // Half a second between frames, fewer measurements than correlation times, and a fifth of them: 1.68 times the error, 1.12 times
    // the sigma.
    assert!(two.error_m < 1.9 * ten.error_m && two.sigma_m < 1.3 * ten.sigma_m, "{two:?} {ten:?}");
    // The sigma covers the error at every rate.
    for one in [two, five, ten, twenty_five, fifty] {
        assert!(one.error_m < 1.2 * one.sigma_m, "{one:?}");
    }
}

#[test]
fn unequal_intervals_are_no_worse() {
    // Bursts, and pauses of up to a fifth of a second: ten frames a second on average.
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut ticks = vec![0];
    while ticks.last().is_some_and(|t| *t + 10 < (SECONDS / TICK_S) as usize) {
        ticks.extend(ticks.last().map(|t| t + random.random_range(1..=9)));
    }
    let (unequal, ten) = (whole_drive(&ticks), whole_drive(&every(5)));
    println!("unequal: {unequal:?}\n10: {ten:?}");
    assert!(unequal.is_like(ten), "{unequal:?} {ten:?}");
}

#[test]
fn online_estimates_are_the_same_at_5_to_50_frames_a_second() {
    let [five, ten, twenty_five, fifty] = [10, 5, 2, 1].map(|ticks| online(&every(ticks)));
    println!("5: {five:?}\n10: {ten:?}\n25: {twenty_five:?}\n50: {fifty:?}");
    for other in [five, twenty_five, fifty] {
        assert!(other.is_like(ten), "{other:?} {ten:?}");
    }
}
