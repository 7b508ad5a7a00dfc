//! Metric scale by the paper's closed form (eqs. 1, 3–5): road matches lifted onto a fixed plane, one α a match, the mean.

use std::sync::Arc;

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::median};
use nalgebra::{Matrix2, Matrix3, Point2, Vector3};

use super::measurement::{RoadMeasurement, forget_before};
use super::options::{ClosedFormOptions, ScaleAverage};
use super::state::RoadState;
use super::tracker::RoadInput;
use crate::time::nanoseconds;
use crate::tracking::{KltOptions, Pyramid, Request, detect, track_checked};

/// Matches of road points between frames, and the scale of each frame.
pub struct ClosedFormScale {
    camera: PinholeCamera,
    options: ClosedFormOptions,
    klt: KltOptions,
    last: Option<LastFrame>,
    /// Camera height in the odometry's unit, from the last frame's scale: predicts where road points go.
    height_units: Option<f64>,
    measurements: Vec<RoadMeasurement>,
}

/// State of a [`ClosedFormScale`] after a frame, without camera and options.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ClosedFormState {
    last: Option<LastFrame>,
    height_units: Option<f64>,
    measurements: Vec<RoadMeasurement>,
}

/// The frame that the next one is compared with.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct LastFrame {
    frame: usize,
    timestamp_ns: i64,
    segment: usize,
    #[serde(with = "crate::tracking::stored")]
    pyramid: Arc<Pyramid>,
}

impl ClosedFormScale {
    /// An estimator without measurements.
    pub fn new(camera: PinholeCamera, options: ClosedFormOptions) -> Self {
        let mut klt = KltOptions::default();
        klt.advanced.least_eigenvalue = options.advanced.least_eigenvalue;
        Self { camera, options, klt, last: None, height_units: None, measurements: Vec::new() }
    }

    /// The state after the last frame.
    pub fn state(&self) -> ClosedFormState {
        let Self { camera: _, options: _, klt: _, last, height_units, measurements } = self;
        ClosedFormState {
            last: last.clone(),
            height_units: *height_units,
            measurements: measurements.clone(),
        }
    }

    /// Ready for the frame after a state, with the camera and the options that it came from.
    pub fn from_state(camera: PinholeCamera, options: ClosedFormOptions, state: ClosedFormState) -> Self {
        let ClosedFormState { last, height_units, measurements } = state;
        Self { last, height_units, measurements, ..Self::new(camera, options) }
    }

    /// Measurements so far; pitch and roll are zero by assumption.
    pub fn measurements(&self) -> &[RoadMeasurement] {
        &self.measurements
    }

    /// As [`RoadTracker::forget_before`](super::RoadTracker::forget_before).
    pub fn forget_before(&mut self, frame: usize) -> Vec<RoadMeasurement> {
        forget_before(&mut self.measurements, frame)
    }

    /// As [`RoadTracker::put_back`](super::RoadTracker::put_back).
    pub fn put_back(&mut self, older: Vec<RoadMeasurement>) {
        drop(self.measurements.splice(..0, older));
    }

    /// The frame that the next one is compared with.
    pub fn oldest(&self) -> Option<usize> {
        self.last.as_ref().map(|last| last.frame)
    }

    /// Ends the drive: all measurements but those taken out.
    pub fn finish(self) -> Vec<RoadMeasurement> {
        self.measurements
    }

    /// Camera height in the odometry's unit by the last measurement.
    pub fn height_units(&self) -> Option<f64> {
        self.height_units
    }

    /// Road point for a pixel and camera height 1, eq. (1) with n = (0, −1, 0); `None` beyond T or above the horizon.
    fn lift(&self, pixel: &Point2<f64>) -> Option<Vector3<f64>> {
        let ray = self.camera.ray(pixel);
        (ray.y * self.options.farthest_heights > 1.0).then(|| ray / ray.y)
    }

    /// Processes a frame and returns its measurement. `pose_of` gives camera poses of its segment, `usable` the pixels that
    /// may be road.
    pub fn process(
        &mut self,
        input: &RoadInput<'_>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<RoadMeasurement> {
        let interval = 0..nanoseconds(self.options.advanced.interval_s);
        let same = |l: &&LastFrame| l.segment == input.segment;
        if self
            .last
            .as_ref()
            .filter(same)
            .is_some_and(|l| interval.contains(&(input.timestamp_ns - l.timestamp_ns)))
        {
            return None;
        }
        let current = LastFrame {
            frame: input.frame,
            timestamp_ns: input.timestamp_ns,
            segment: input.segment,
            pyramid: input.pyramid.clone(),
        };
        let Some(last) = self.last.replace(current).filter(|l| l.segment == input.segment) else {
            self.height_units = None;
            return None;
        };
        // Eq. (2).
        let last_from_current = pose_of(last.frame)? * pose_of(input.frame)?.inverse();
        let mut alphas = self.alphas(&last.pyramid, input.pyramid, &last_from_current, usable);
        if alphas.len() < self.options.advanced.least_matches {
            return None;
        }
        let mean = average(self.options.average, &mut alphas).filter(|m| m.is_finite() && *m > 0.0)?;
        let spread = alphas.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / alphas.len() as f64;
        let variance =
            (spread / (mean * mean * alphas.len() as f64)).max(self.options.advanced.least_variance);
        let tilt_variance = self.options.advanced.tilt_variance_rad2;
        self.height_units = Some(1.0 / mean);
        let measured = RoadMeasurement {
            frame: input.frame,
            reference: last.frame,
            state: RoadState { log_inverse_height: mean.ln(), pitch_rad: 0.0, roll_rad: 0.0 },
            baseline: last_from_current.translation().norm(),
            covariance: Matrix3::from_diagonal(&Vector3::new(variance, tilt_variance, tilt_variance)),
            curvature: None,
            agreement: 1.0,
            pixels: alphas.len(),
        };
        self.measurements.push(measured);
        Some(measured)
    }

    /// One α per tracked road corner, for camera height 1.
    fn alphas(
        &self,
        last: &Pyramid,
        current: &Pyramid,
        last_from_current: &Pose<Camera, Camera>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) -> Vec<f64> {
        let allowed = |x: usize, y: usize| {
            let p = Point2::new(x as f64, y as f64);
            self.lift(&p).is_some_and(|point| point.x.abs() < self.options.advanced.half_width_heights)
                && usable(&p)
        };
        let match_corner = |corner: Point2<f64>| {
            let point = self.lift(&corner)?;
            let expected = self.predict(&point, last_from_current).unwrap_or(corner);
            let top_level = self.klt.advanced.landmark_level;
            let request = Request { from: corner, expected, from_offset: Matrix2::identity(), top_level };
            let tracked = track_checked(last, current, &request, &self.klt)?;
            alpha(&point, &self.lift(&tracked)?, last_from_current)
        };
        detect(last.level(0), &[], allowed, &self.options.advanced.corners)
            .into_iter()
            .filter_map(match_corner)
            .collect()
    }

    /// Pixel of a road point of the last frame in the current one.
    fn predict(&self, point: &Vector3<f64>, last_from_current: &Pose<Camera, Camera>) -> Option<Point2<f64>> {
        let height = self.height_units.unwrap_or(self.options.advanced.guess_units);
        self.camera.project(&last_from_current.inverse().transform_point(&(point * height).into()))
    }
}

/// The scale of a frame by those of its matches, eq. (5); `None` of nothing.
fn average(average: ScaleAverage, alphas: &mut [f64]) -> Option<f64> {
    match average {
        ScaleAverage::Mean => (!alphas.is_empty()).then(|| alphas.iter().sum::<f64>() / alphas.len() as f64),
        ScaleAverage::Median => median(alphas),
    }
}

/// Eq. (4), the least-squares solution of eq. (3) `X_last = R X_current + α t`: `α = (X_last − R X_current)ᵀ t / (tᵀ t)`, for
/// camera height 1. `None` without motion.
fn alpha(
    last: &Vector3<f64>,
    current: &Vector3<f64>,
    last_from_current: &Pose<Camera, Camera>,
) -> Option<f64> {
    let t = last_from_current.translation();
    let norm2 = t.norm_squared();
    (norm2 > 1e-8).then(|| (last - last_from_current.transform_vector(current)).dot(&t) / norm2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;
    use nalgebra::Vector6;

    /// Pixels of one road point in two frames, lifted onto the road by eq. (1), give the scale of the motion between them.
    #[test]
    fn a_level_road_gives_the_scale_of_the_motion() {
        let (metres_per_unit, height_m) = (0.7, 1.65);
        // Yaw and translation in the road plane, in the odometry's unit.
        let step: Pose<Camera, Camera> = Pose::exp(&Vector6::new(0.0, 0.02, 0.0, 0.1, 0.0, 1.5));
        let lift = ClosedFormScale::new(CAMERA, ClosedFormOptions::default());
        for (x_m, z_m) in [(0.8, 9.0), (-2.0, 6.5), (0.1, 10.2)] {
            let current_m = Vector3::new(x_m, height_m, z_m);
            let last_m = step.scaled(metres_per_unit).transform_point(&current_m.into());
            let pixels = [CAMERA.project(&current_m.into()).unwrap(), CAMERA.project(&last_m).unwrap()];
            let [current, last] = pixels.map(|p| lift.lift(&p).unwrap());
            // α is metres per unit over the camera's height in metres.
            let found = alpha(&last, &current, &step).unwrap();
            assert!((found * height_m - metres_per_unit).abs() < 1e-9, "{found}");
        }
        assert!(alpha(&Vector3::x(), &Vector3::x(), &Pose::identity()).is_none(), "no motion, no scale");
    }

    #[test]
    fn points_beyond_t_and_above_the_horizon_are_not_lifted() {
        let options = ClosedFormOptions { farthest_heights: 10.0, ..ClosedFormOptions::default() };
        let scale = ClosedFormScale::new(CAMERA, options);
        let row = |depth_heights: f64| Point2::new(600.0, 180.0 + 720.0 / depth_heights);
        assert!(scale.lift(&row(9.9)).is_some_and(|p| (p.z - 9.9).abs() < 1e-9));
        assert!(scale.lift(&row(10.1)).is_none());
        assert!(scale.lift(&Point2::new(600.0, 170.0)).is_none());
    }

    #[test]
    fn mean_and_median_of_the_scales() {
        let mut alphas = [1.0, 9.0, 2.0];
        assert_eq!(average(ScaleAverage::Mean, &mut alphas), Some(4.0));
        assert_eq!(average(ScaleAverage::Median, &mut alphas), Some(2.0));
        assert_eq!(average(ScaleAverage::Mean, &mut []), None);
    }
}
