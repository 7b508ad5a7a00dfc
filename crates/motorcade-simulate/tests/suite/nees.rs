//! Consistency of covariances: the normalised estimation error squared of the camera's poses.

use motorcade_geometry::robust::median_midpoint;
use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::EgoFrame;

/// 95 % quantile of χ²₆.
const CHI2_95: f64 = 12.592;

/// Over all frames but the first, which is the world itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nees {
    /// Share of frames below 12.6; 0.95 when covariances are right.
    pub within: f64,
    /// Median; 5.35 when covariances are right, less when they are too large.
    pub median: f64,
}

/// Consistency of the frames' covariances with their errors, worlds = first cameras. Frames whose covariance cannot be inverted
/// count as outside.
pub fn nees(frames: &[EgoFrame], truth: &[Pose<World, Camera>]) -> Option<Nees> {
    let (poses, covariances): (Vec<_>, Vec<_>) =
        frames.iter().map(|f| (f.world_from_camera, f.covariance)).unzip();
    let values = motorcade_evaluate::nees(&poses, truth, &covariances).ok()?;
    let mut values: Vec<f64> = values.iter().skip(1).map(|v| v.unwrap_or(f64::INFINITY)).collect();
    let within = values.iter().filter(|v| **v < CHI2_95).count() as f64 / values.len().max(1) as f64;
    Some(Nees { within, median: median_midpoint(&mut values)? })
}
