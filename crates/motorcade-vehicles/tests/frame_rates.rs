//! One generated motion at several frame rates: errors, P(moving) and cost do not depend on the rate.

#![allow(clippy::unwrap_used, reason = "a test")]

use cpu_time::ThreadTime;
use motorcade_geometry::{Camera, Pose};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M, Drive};
use motorcade_vehicles::{
    ExternalTrack, GroundFrame, TrackerOptions, VehicleOptions, VehicleTrajectory, estimate_track, image_box,
    size_prior, track_vehicles, upright_pose,
};
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Position along z and speed of a car at a time, and its lateral position.
struct Motion {
    name: &'static str,
    x_m: f64,
    z_m: fn(f64) -> f64,
    speed_mps: fn(f64) -> f64,
}

const MOTIONS: [Motion; 4] = [
    Motion { name: "oncoming", x_m: -3.5, z_m: |t| 105.0 - 12.0 * t, speed_mps: |_| 12.0 },
    Motion { name: "ahead", x_m: 0.0, z_m: |t| 22.0 + 10.0 * t, speed_mps: |_| 10.0 },
    Motion {
        name: "accelerating and braking",
        x_m: 0.5,
        z_m: |t| 20.0 + 10.0 * t + 1.5 * (t - t.sin()),
        speed_mps: |t| 10.0 + 1.5 * (1.0 - t.cos()),
    },
    Motion { name: "parked", x_m: 4.0, z_m: |_| 62.0, speed_mps: |_| 0.0 },
];
const DURATION_S: f64 = 4.0;
/// All rates divide this one, at which the noise is generated.
const FINEST_FPS: usize = 50;

fn grounds(fps: f64, duration_s: f64) -> Vec<GroundFrame> {
    let drive = Drive::straight((duration_s * fps).round() as usize + 1, fps, 10.0);
    let one = |(pose, time_s): (&Pose<_, Camera>, &f64)| GroundFrame {
        world_from_camera: *pose,
        up: -Vector3::y(),
        height_m: CAMERA_HEIGHT_M,
        pitch_sigma_rad: 0.002,
        slope_change_sigma_rad: 0.0,
        road_ahead: None,
        time_s: *time_s,
    };
    drive.world_from_camera.iter().zip(&drive.times_s).map(one).collect()
}

/// Boxes with errors correlated over 0.1 s (Ornstein–Uhlenbeck), sampled from one realisation at 50 frames/s.
fn boxes(motion: &Motion, fps: usize, duration_s: f64, seed: u64) -> Vec<Vec<Detection>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let decay = (-1.0 / (FINEST_FPS as f64 * 0.1)).exp();
    let mut noise = [normal(), normal(), normal(), normal()];
    let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
    let mut out = Vec::new();
    for (k, ground) in grounds(FINEST_FPS as f64, duration_s).iter().enumerate() {
        if k > 0 {
            noise = noise.map(|v| decay * v + (1.0 - decay * decay).sqrt() * normal());
        }
        if k % (FINEST_FPS / fps) != 0 {
            continue;
        }
        let z = (motion.z_m)(ground.time_s);
        let position = Point3::new(motion.x_m, CAMERA_HEIGHT_M, z);
        let forward = if motion.name == "oncoming" { -Vector3::z() } else { Vector3::z() };
        let camera_from_world = ground.world_from_camera.inverse();
        let in_camera = camera_from_world.transform_point(&position);
        let pose = upright_pose(&in_camera, &camera_from_world.transform_vector(&forward), &ground.up);
        let bbox = image_box(&CAMERA, &pose, class, convention, &size_prior(class).mean);
        let found = bbox.map(|b| {
            let sigma = |side: f64| (1.2_f64.powi(2) + (0.025 * side).powi(2)).sqrt();
            let (w, h) = (sigma(b.width()), sigma(b.height()));
            let bbox = BoundingBox {
                x1: b.x1 + w * noise[0],
                y1: b.y1 + h * noise[1],
                x2: b.x2 + w * noise[2],
                y2: b.y2 + h * noise[3],
            };
            let bbox = bbox.clipped(CAMERA.width, CAMERA.height);
            Detection {
                bbox,
                score: 0.8,
                class,
                convention,
                external_id: None,
                pixel_size: 1.0,
                road_below: None,
            }
        });
        out.push(found.into_iter().collect());
    }
    out
}

fn estimate(motion: &Motion, fps: usize, duration_s: f64, seed: u64) -> VehicleTrajectory {
    let (grounds, options) = (grounds(fps as f64, duration_s), VehicleOptions::default());
    let detections = boxes(motion, fps, duration_s, seed);
    let tracks =
        track_vehicles(&CAMERA, &grounds, &detections, &TrackerOptions::default(), &options, &|| false);
    assert_eq!(tracks.len(), 1, "{} at {fps} frames/s, seed {seed}", motion.name);
    estimate_track(&CAMERA, &grounds, &tracks[0], &ExternalTrack::default(), &options).unwrap()
}

/// RMS errors of position \[m\] and speed \[m/s\] over seeds at the times common to all rates, and mean P(moving).
fn errors(motion: &Motion, fps: usize) -> [f64; 3] {
    const SEEDS: u64 = 12;
    let (mut position, mut speed, mut p_moving, mut count) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..SEEDS {
        let vehicle = estimate(motion, fps, DURATION_S, seed);
        p_moving += vehicle.p_moving / SEEDS as f64;
        for state in vehicle.states.iter().filter(|s| s.frame % (fps / 5) == 0) {
            let t = state.frame as f64 / fps as f64;
            let true_z = (motion.z_m)(t);
            let error =
                state.world_from_vehicle.translation() - Vector3::new(motion.x_m, CAMERA_HEIGHT_M, true_z);
            position += error.norm_squared();
            speed += (state.speed_mps.abs() - (motion.speed_mps)(t)).powi(2);
            count += 1.0;
        }
    }
    [(position / count).sqrt(), (speed / count).sqrt(), p_moving]
}

#[test]
fn errors_do_not_depend_on_the_frame_rate() {
    for motion in &MOTIONS {
        let [position, speed, p_moving] = errors(motion, 10);
        println!("{}: 10 frames/s: {position:.2} m, {speed:.2} m/s, P {p_moving:.2}", motion.name);
        for fps in [5, 25, 50] {
            let [p, s, moving] = errors(motion, fps);
            println!("{}: {fps} frames/s: {p:.2} m, {s:.2} m/s, P {moving:.2}", motion.name);
            // Below 5 cm and 5 cm/s ratios have no meaning.
            assert!(p < 1.3 * position.max(0.05), "{} {fps}: {p} m, {position} m at 10", motion.name);
            assert!(s < 1.3 * speed.max(0.05), "{} {fps}: {s} m/s, {speed} m/s at 10", motion.name);
            assert!((moving - p_moving).abs() < 0.15, "{} {fps}: {moving}, {p_moving} at 10", motion.name);
        }
    }
}

#[test]
fn cost_grows_linearly_with_the_frames() {
    // A minute behind a car: five times the frames, at most eight times the time; a quadratic part would show.
    let cost_s = |fps: usize| {
        let run = || {
            let start = ThreadTime::now();
            let vehicle = estimate(&MOTIONS[1], fps, 60.0, 1);
            assert_eq!(vehicle.states.len(), 60 * fps + 1);
            start.elapsed().as_secs_f64()
        };
        (0..3).map(|_| run()).fold(f64::INFINITY, f64::min)
    };
    let (slow, fast) = (cost_s(10), cost_s(50));
    println!("{slow:.3} s at 10 frames/s, {fast:.3} s at 50");
    assert!(fast < 8.0 * slow, "{slow} s at 10 frames/s, {fast} s at 50");
}
