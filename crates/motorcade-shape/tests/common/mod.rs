//! Shared by the tests: the folder of reference data, vehicles before a camera.
#![allow(dead_code, clippy::print_stderr)] // every test uses its part

use std::path::{Path, PathBuf};

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use motorcade_shape::fit::ObservedKeypoint;
use motorcade_shape::{ShapePrior, project};
use nalgebra::{Matrix3, Point2, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// `MOTORCADE_SHARED`, or `shared` beside the repository, with the named part in it; prints a note when it is missing.
pub fn shared(part: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("MOTORCADE_SHARED").map_or_else(beside, PathBuf::from).join(part);
    if !folder.exists() {
        eprintln!("SKIPPED: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

/// A camera as KITTI's.
pub fn camera() -> PinholeCamera {
    PinholeCamera { fx: 720.0, fy: 720.0, cx: 610.0, cy: 175.0, width: 1242, height: 375 }
}

/// A vehicle on a level road 1.65 m below the camera; heading 0 drives away, positive turns left.
pub fn standing(x: f64, z: f64, heading_rad: f64) -> Pose<Camera, Vehicle> {
    let (s, c) = heading_rad.sin_cos();
    let rotation = Matrix3::from_columns(&[
        Vector3::new(-s, 0.0, c),
        Vector3::new(-c, 0.0, -s),
        Vector3::new(0.0, -1.0, 0.0),
    ]);
    Pose::from_matrix(&rotation, &Vector3::new(x, 1.65, z))
}

/// Angle between two headings \[rad\].
pub fn heading_error_rad(a: &Pose<Camera, Vehicle>, b: &Pose<Camera, Vehicle>) -> f64 {
    let forward = |p: &Pose<Camera, Vehicle>| p.transform_vector(&Vector3::x());
    forward(a).angle(&forward(b))
}

/// How a simulated network errs.
#[derive(Clone, Copy)]
pub struct Network {
    /// Pixel noise \[px\].
    pub sigma_px: f64,
    /// Share of seen points put anywhere within 60 px.
    pub outliers: f64,
    /// Share of points that face the camera and yet go unseen.
    pub hidden: f64,
    /// Noise of the body itself (per axis) \[m\].
    pub body_sigma_m: f64,
}

/// Network output for a shape.
pub fn look(
    prior: &ShapePrior,
    coefficients: &[f64],
    pose: &Pose<Camera, Vehicle>,
    network: &Network,
    rng: &mut impl Rng,
) -> Vec<ObservedKeypoint> {
    project(prior, coefficients, pose, &camera())
        .into_iter()
        .map(|point| {
            let mut normal = || -> f64 { StandardNormal.sample(rng) };
            let body = network.body_sigma_m * camera().fx / point.depth_m.max(1.0);
            let sigma = network.sigma_px.hypot(body);
            let mut pixel =
                point.pixel.unwrap_or_default() + nalgebra::Vector2::new(normal(), normal()) * sigma;
            let (hidden, outlier) = (rng.random::<f64>() < network.hidden, rng.random::<f64>());
            if outlier < network.outliers {
                pixel += nalgebra::Vector2::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5) * 120.0;
            }
            let confidence = if point.visible && !hidden { 1.0 } else { 0.0 };
            ObservedKeypoint::new(Point2::new(pixel.x, pixel.y), confidence)
        })
        .collect()
}

/// The median.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}
