//! Metric scale by the paper's closed form (eqs. 1, 3–5): road matches lifted onto a fixed plane, one α a match, the mean.

use std::sync::Arc;

use motorcade_geometry::{Camera, PinholeCamera, Pose, robust::median};
use nalgebra::{Matrix2, Matrix3, Point2, Vector3};

use super::measurement::RoadMeasurement;
use crate::tracking::Pyramid;
use crate::tracking::{CornerOptions, detect};
use crate::tracking::{KltOptions, Request, track_checked};

/// How the scales of many matches become one.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum ScaleAverage {
    /// Eq. (5).
    #[default]
    Mean,
    /// Robust against matches that are wrong, not against a wrong plane.
    Median,
}

impl ScaleAverage {
    /// `None` of nothing.
    fn of(self, alphas: &mut [f64]) -> Option<f64> {
        match self {
            Self::Mean => (!alphas.is_empty()).then(|| alphas.iter().sum::<f64>() / alphas.len() as f64),
            Self::Median => median(alphas),
        }
    }
}

/// Road matches per frame and the scale they give.
pub struct ClosedFormScale {
    camera: PinholeCamera,
    /// Farthest road point used \[camera heights\] (the paper's T over its camera's height).
    farthest_heights: f64,
    average: ScaleAverage,
    /// Last frame: number, image, its segment.
    last: Option<(usize, Arc<Pyramid>, usize)>,
    /// Camera height in the odometry's unit, from the last frame's scale: predicts where road points go.
    height_units: Option<f64>,
    measurements: Vec<RoadMeasurement>,
}

impl ClosedFormScale {
    /// Knows nothing yet.
    pub fn new(camera: PinholeCamera, farthest_heights: f64, average: ScaleAverage) -> Self {
        Self { camera, farthest_heights, average, last: None, height_units: None, measurements: Vec::new() }
    }

    /// Measurements so far: log(α/h), pitch and roll zero by assumption.
    pub fn measurements(&self) -> &[RoadMeasurement] {
        &self.measurements
    }

    /// Camera height in the odometry's unit by the last frame that told it.
    pub fn height_units(&self) -> Option<f64> {
        self.height_units
    }

    /// Road point of unit camera height for a pixel, eq. (1) with n = (0, −1, 0); `None` beyond T or above the horizon.
    fn lift(&self, pixel: &Point2<f64>) -> Option<Vector3<f64>> {
        let ray = self.camera.ray(pixel);
        (ray.y * self.farthest_heights > 1.0).then(|| ray / ray.y)
    }

    /// Takes frame `frame`; `pose_of` gives camera poses of this segment, `usable` the pixels that may be road.
    pub fn process(
        &mut self,
        frame: usize,
        segment: usize,
        pyramid: &Arc<Pyramid>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, motorcade_geometry::World>>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) {
        let last = self.last.replace((frame, pyramid.clone(), segment));
        let Some((before, image, same)) = last.filter(|(_, _, s)| *s == segment) else {
            self.height_units = None;
            return;
        };
        debug_assert_eq!(same, segment);
        let (Some(a), Some(b)) = (pose_of(before), pose_of(frame)) else { return };
        let before_from_now: Pose<Camera, Camera> = (a * b.inverse()).cast();
        let allowed = |x: usize, y: usize| {
            let p = Point2::new(x as f64, y as f64);
            self.lift(&p).is_some_and(|point| point.x.abs() < 2.5) && usable(&p)
        };
        // Asphalt has weak corners, but many.
        let options = CornerOptions {
            columns: 41,
            per_cell: 2,
            distance_px: 7.0,
            least_eigenvalue: 2.0,
            border_px: 12,
        };
        let corners = detect(image.level(0), &[], allowed, &options);
        let klt = KltOptions { least_eigenvalue: 1.0, ..KltOptions::default() };
        let mut alphas: Vec<f64> = Vec::new();
        for corner in corners {
            let Some(point) = self.lift(&corner) else { continue };
            let expected = self.predict(&point, &before_from_now).unwrap_or(corner);
            let request = Request { from: corner, expected, from_offset: Matrix2::identity(), top_level: 2 };
            let now = track_checked(&image, pyramid, &request, &klt);
            alphas.extend(
                now.and_then(|p| self.lift(&p)).and_then(|now| alpha(&point, &now, &before_from_now)),
            );
        }
        if alphas.len() < 5 {
            return;
        }
        let Some(mean) = self.average.of(&mut alphas).filter(|m| m.is_finite() && *m > 0.0) else { return };
        let spread = alphas.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / alphas.len() as f64;
        let variance = spread / (mean * mean * alphas.len() as f64);
        self.height_units = Some(1.0 / mean);
        self.measurements.push(RoadMeasurement {
            frame,
            reference: before,
            value: Vector3::new(mean.ln(), 0.0, 0.0),
            baseline: before_from_now.translation().norm(),
            covariance: Matrix3::from_diagonal(&Vector3::new(variance.max(1e-8), 1e-4, 1e-4)),
            curvature: None,
            agreement: 1.0,
            pixels: alphas.len(),
        });
    }

    fn predict(&self, point: &Vector3<f64>, before_from_now: &Pose<Camera, Camera>) -> Option<Point2<f64>> {
        // Before any scale is known a camera is taken to be two units high, as the odometry's unit makes it.
        let height = self.height_units.unwrap_or(2.0);
        let now = before_from_now.inverse().transform_point(&(point * height).into());
        self.camera.project(&now)
    }
}

/// Eq. (4): `α = (X_before − R X_now)ᵀ t / (tᵀ t)` for camera height 1.
fn alpha(before: &Vector3<f64>, now: &Vector3<f64>, before_from_now: &Pose<Camera, Camera>) -> Option<f64> {
    let t = before_from_now.translation();
    let norm2 = t.norm_squared();
    (norm2 > 1e-8).then(|| (before - before_from_now.transform_vector(now)).dot(&t) / norm2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn a_level_road_gives_the_exact_scale() {
        // Two units of odometry are 1.65 m: α per camera height is (1/1.65)·(1.65/2) …
        let metres_per_unit = 0.7;
        let height = 1.65;
        let step: Pose<Camera, Camera> = Pose::exp(&Vector6::new(0.0, 0.02, 0.0, 0.0, 0.0, 1.5));
        let now_metric = Vector3::new(0.8, height, 9.0);
        let metric_step = step.scaled(metres_per_unit);
        let before_metric = metric_step.transform_point(&now_metric.into()).coords;
        let found = alpha(&(before_metric / height), &(now_metric / height), &step).unwrap();
        assert!((found * height - metres_per_unit).abs() < 1e-12);
        assert!(alpha(&now_metric, &now_metric, &Pose::identity()).is_none());
    }
}
