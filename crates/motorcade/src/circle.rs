//! A circle of corners that is driven round, for tests of places.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{
    EgoFrame, EgoTrajectory, ExternalTrajectoryOptions, MetricOptions, OdometryTrajectory,
};
use motorcade_places::{Descriptor, Feature, PlaceKeyframe};
pub(crate) use motorcade_testing::CAMERA;
use nalgebra::{Point3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::record::FrameInfo;

/// Frames of a round, 1 m apart; every third is a keyframe.
pub(crate) const ROUND: usize = 210;

/// Frames, their exact poses, those of a drifting odometry, and keyframes of places.
pub(crate) struct Scene {
    pub(crate) truth: Vec<Pose<World, Camera>>,
    pub(crate) ego: Vec<EgoFrame>,
    pub(crate) motion: OdometryTrajectory,
    pub(crate) frames: Vec<FrameInfo>,
    pub(crate) places: Vec<PlaceKeyframe>,
}

/// `length` frames of the circle, seen with corners of random looks; `same` false gives the second round corners of its own.
pub(crate) fn scene(length: usize, same: bool) -> Scene {
    let step = Vector6::new(0.0, std::f64::consts::TAU / ROUND as f64, 0.0, 0.0, 0.0, 1.0);
    let mut truth: Vec<Pose<World, Camera>> = vec![Pose::identity()];
    let mut drifted: Vec<Pose<World, Camera>> = vec![Pose::identity()];
    for k in 1..length {
        let drift = Vector6::new(0.0, 2e-4, 0.0, 0.0, 0.0, 0.002);
        truth.push(truth[k - 1].retract(&step));
        drifted.push(drifted[k - 1].retract(&(step + drift)));
    }
    let times_ns: Vec<i64> = (0..length as i64).map(|k| k * 100_000_000).collect();
    let motion = OdometryTrajectory::from_poses(&drifted, &times_ns, &ExternalTrajectoryOptions::default());
    let ego = EgoTrajectory::metric(&motion, &[], 1.65, 0.006, &MetricOptions::default()).frames;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut corners = |round: &[Pose<World, Camera>]| -> Vec<(Point3<f64>, Descriptor)> {
        let mut corner = |k: usize| {
            let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let beside = Point3::new(side * rng.random_range(4.0..9.0), rng.random_range(-4.0..1.5), 0.0);
            let look = Descriptor(std::array::from_fn(|_| rng.random()));
            (round[(k / 16) % round.len()].transform_point(&beside), look)
        };
        (0..16 * ROUND).map(&mut corner).collect()
    };
    let rounds = [corners(&truth[..ROUND]), corners(&truth[..ROUND])];
    let mut noise = ChaCha8Rng::seed_from_u64(4);
    let mut keyframe = |frame: usize| {
        let camera_from_world = truth[frame].inverse();
        let all = if same || frame < ROUND { &rounds[0] } else { &rounds[1] };
        let seen = all.iter().filter_map(|(point, descriptor)| {
            let p = camera_from_world.transform_point(point);
            let pixel = CAMERA.project(&p).filter(|pixel| p.z < 35.0 && CAMERA.contains(pixel, 5.0))?;
            let mut off = || noise.random_range(-0.4..0.4);
            let pixel = [(pixel.x + off()) as f32, (pixel.y + off()) as f32];
            Some(Feature { descriptor: *descriptor, pixel, level: 0, turn: 0 })
        });
        PlaceKeyframe { frame, features: seen.take(320).collect(), ..PlaceKeyframe::default() }
    };
    let places = (0..length).step_by(3).map(&mut keyframe).collect();
    let info = |(number, t): (u64, &i64)| FrameInfo { number, timestamp_ns: *t, problem: None };
    let frames = (0..).zip(&times_ns).map(info).collect();
    Scene { truth, ego, motion, frames, places }
}
