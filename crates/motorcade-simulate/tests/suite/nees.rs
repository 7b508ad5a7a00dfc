//! Whether covariances are honest: the normalised estimation error squared of the camera's poses.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::EgoFrame;
use nalgebra::Vector6;

/// 95 % of a chi-square with 6 degrees of freedom lies below.
const CHI2_95: f64 = 12.592;

/// Over all frames but the first, which is the world itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nees {
    /// Share of frames below 12.6; 0.95 when covariances are right.
    pub within: f64,
    /// Median; 5.35 when covariances are right, less when they are too large.
    pub median: f64,
}

/// Errors `log(estimate⁻¹ · truth)` in `[ω, ν]`, worlds = first cameras, weighed by the estimates' covariances. Frames
/// whose covariance cannot be inverted count as outside.
pub fn nees(frames: &[EgoFrame], truth: &[Pose<World, Camera>]) -> Option<Nees> {
    let (first, first_truth) = (frames.first()?.world_from_camera, truth.first()?);
    let moved = |origin: &Pose<World, Camera>, pose: &Pose<World, Camera>| origin.inverse() * *pose;
    let mut values: Vec<f64> = frames
        .iter()
        .zip(truth)
        .skip(1)
        .map(|(frame, truth)| {
            let estimate = moved(&first, &frame.world_from_camera);
            let error: Vector6<f64> = (estimate.inverse() * moved(first_truth, truth)).log();
            frame.covariance.cholesky().map_or(f64::INFINITY, |c| error.dot(&c.solve(&error)))
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let within = values.iter().filter(|v| **v < CHI2_95).count() as f64 / values.len().max(1) as f64;
    Some(Nees { within, median: *values.get(values.len() / 2)? })
}
