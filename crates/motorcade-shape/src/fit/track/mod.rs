//! One vehicle in many images: a pose per frame, one shape for all.

mod joint;
mod result;

use motorcade_geometry::PinholeCamera;
use nalgebra::Vector3;

use super::fitter::ShapeFitter;
use super::model::{Shape, State};
use super::observation::Observation;
use super::problem::{Problem, Row};
use super::result::ShapeFit;
use super::solver::{Effort, Free, cost_of, refine};
use super::track_shape::TrackShape;
use crate::error::FitError;
use joint::Frame;

pub use result::{FrameFit, TrackFit};

impl ShapeFitter {
    /// Poses of a vehicle in many images with one shape for all: every frame is first fitted alone, then all poses and the
    /// shape together, poses eliminated by the Schur complement. Unusable frames return their error; the size
    /// prior of the first usable frame enters once. [`FitError::NoSolution`] when no frame can be used.
    pub fn fit_track(
        &self,
        camera: &PinholeCamera,
        observations: &[Observation],
    ) -> Result<TrackFit, FitError> {
        self.fit_similar_views(camera, observations, 0.0)
    }

    /// As [`fit_track`](Self::fit_track) for detectors that misplace a point in the same way in similar views: errors of two frames
    /// are correlated by `exp(−½ (angle / similar_rad)²)`, with the angle between the directions from which they show the vehicle.
    /// Frames then count as fewer independent ones, and the prior of the shape keeps its weight. At 0 all frames are independent.
    pub fn fit_similar_views(
        &self,
        camera: &PinholeCamera,
        observations: &[Observation],
        similar_rad: f64,
    ) -> Result<TrackFit, FitError> {
        let mut errors: Vec<Option<FitError>> = vec![None; observations.len()];
        let mut frames = Vec::new();
        let mut rows = Vec::new();
        for (index, observation) in observations.iter().enumerate() {
            match self.fit(camera, observation) {
                Err(error) => errors[index] = Some(error),
                Ok(single) => frames.push(self.frame(camera, observation, single, index)),
            }
        }
        if frames.is_empty() {
            return Err(errors.into_iter().flatten().next().unwrap_or(FitError::NoSolution));
        }
        let count = frames.len() as f64;
        let repeated = count / independent_views(&frames, similar_rad);
        let shape = frames.iter().fold(Shape::zeros(), |sum, f| sum + f.state.shape / count);
        frames.iter_mut().for_each(|f| f.state.shape = shape);

        let mut cost = self.solve(&mut frames, repeated, &mut rows);
        if self.turn_flipped(camera, observations, &mut frames, &mut rows) {
            cost = self.solve(&mut frames, repeated, &mut rows);
        }
        let (fits, covariance) = self.marginals(&frames, repeated, &mut rows)?;
        let shape = TrackShape { mean: frames[0].state.shape, covariance };
        let coefficients = self.model.coefficients(&shape.mean);
        let slope = &self.model.size_slope;
        let mut out: Vec<Result<FrameFit, FitError>> =
            errors.into_iter().map(|e| Err(e.unwrap_or(FitError::NoSolution))).collect();
        for (frame, fit) in frames.iter().zip(fits) {
            out[frame.index] = Ok(fit);
        }
        Ok(TrackFit {
            frames: out,
            shape,
            dimensions: self.prior().dimensions(&coefficients),
            size_covariance: slope * covariance * slope.transpose(),
            coefficients,
            cost,
        })
    }

    /// A frame with the pose of its own fit.
    fn frame<'a>(
        &'a self,
        camera: &'a PinholeCamera,
        observation: &Observation,
        single: ShapeFit,
        index: usize,
    ) -> Frame<'a> {
        let swapped = single.sides_swapped;
        let mut problem = Problem::new(&self.model, camera, self.options(), observation, swapped);
        problem.shape_terms = false;
        problem.distance_m = single.camera_from_vehicle.translation().z;
        let state = State {
            camera_from_vehicle: single.camera_from_vehicle,
            shape: self.model.whitened(&single.coefficients),
        };
        Frame { problem, state, single, swapped, index }
    }

    /// Tries the opposite heading of each ambiguous frame under the shared shape; true when one was better.
    fn turn_flipped<'a>(
        &'a self,
        camera: &'a PinholeCamera,
        observations: &[Observation],
        frames: &mut [Frame<'a>],
        rows: &mut Vec<Row>,
    ) -> bool {
        let mut turned = false;
        for frame in frames {
            let Some(opposite) = frame.single.opposite else { continue };
            if !frame.single.heading_is_ambiguous() {
                continue;
            }
            if !frame.problem.rows(&frame.state, rows) {
                continue;
            }
            let now = cost_of(&frame.problem, rows) + frame.problem.discrete_cost(&frame.state);
            let swapped = opposite.sides_swapped;
            let observation = &observations[frame.index];
            let mut problem = Problem::new(&self.model, camera, self.options(), observation, swapped);
            problem.shape_terms = false;
            problem.distance_m = opposite.camera_from_vehicle.translation().z;
            let start = State { camera_from_vehicle: opposite.camera_from_vehicle, shape: frame.state.shape };
            let effort = Effort::full(self.options().max_iterations);
            let Some(there) = refine(&problem, start, Free::Pose, effort, rows) else { continue };
            if there.cost + problem.discrete_cost(&there.state) + self.options().advanced.flip_gain < now {
                (frame.problem, frame.state, frame.swapped) = (problem, there.state, swapped);
                turned = true;
            }
        }
        turned
    }
}

/// Number of independent views that frames with correlated errors are worth: `n² / Σ ρ`, over all pairs.
fn independent_views(frames: &[Frame<'_>], similar_rad: f64) -> f64 {
    // From the vehicle to the camera, vehicle frame.
    let direction = |frame: &Frame<'_>| frame.single.camera_from_vehicle.inverse().translation().normalize();
    let directions: Vec<Vector3<f64>> = frames.iter().map(direction).collect();
    let correlation = |a: &Vector3<f64>, b: &Vector3<f64>| {
        if similar_rad > 0.0 { (-0.5 * (a.angle(b) / similar_rad).powi(2)).exp() } else { 0.0 }
    };
    let mut sum = 0.0;
    for (i, a) in directions.iter().enumerate() {
        sum += 1.0 + 2.0 * directions.iter().skip(i + 1).map(|b| correlation(a, b)).sum::<f64>();
    }
    let count = directions.len() as f64;
    count * count / sum
}
