//! Simulated keypoint networks, and the error of a heading.

use motorcade_geometry::{Camera, Pose, Vehicle};
use motorcade_shape::fit::ObservedKeypoint;
use motorcade_shape::{ShapePrior, project};
use motorcade_testing::CAMERA;
use nalgebra::{Point2, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Angle between two headings \[rad\].
pub fn heading_error_rad(a: &Pose<Camera, Vehicle>, b: &Pose<Camera, Vehicle>) -> f64 {
    let forward = |p: &Pose<Camera, Vehicle>| p.transform_vector(&Vector3::x());
    forward(a).angle(&forward(b))
}

/// Errors of a simulated network.
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
    project(prior, coefficients, pose, &CAMERA)
        .into_iter()
        .map(|point| {
            let mut normal = || -> f64 { StandardNormal.sample(rng) };
            let body = network.body_sigma_m * CAMERA.fx / point.depth_m.max(1.0);
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
