//! One vehicle in many images: a pose per frame, one shape for all.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector6};

use super::fitter::ShapeFitter;
use super::model::{Shape, State};
use super::observation::Observation;
use super::problem::{Problem, Row};
use super::quality::{Quality, information};
use super::result::ShapeFit;
use super::solver::{Effort, Free, Normal, cost_of, refine, step};
use super::track_shape::{ShapeMatrix, TrackShape};
use super::{DOF, MAX_SHAPE};
use crate::dimensions::Dimensions;
use crate::error::FitError;

/// Cost by which the opposite heading must be better under the shared shape.
const FLIP_GAIN: f64 = 1.0;

/// A vehicle's pose in one frame of its track.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFit {
    /// Pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose (6×6 `[ω, ν]`, vehicle frame), the shared shape marginalised.
    pub covariance: Matrix6<f64>,
    /// True for keypoints within the gate, in the order of the observation.
    pub inliers: Vec<bool>,
    /// Robust standard deviation of the whitened keypoint residuals.
    pub residual_sigma: f64,
    /// True when the network's left and right points were exchanged.
    pub sides_swapped: bool,
    /// Cost of the frame without the terms of the shape.
    pub cost: f64,
    /// Cost difference to the opposite heading in this frame alone; negative when the track's shape reversed it.
    pub heading_margin: f64,
}

/// Fit of a vehicle over its track.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackFit {
    /// One entry per observation: its pose, or its error.
    pub frames: Vec<Result<FrameFit, FitError>>,
    /// Shape coefficients λ shared by all frames.
    pub coefficients: Vec<f64>,
    /// The shape, to fit further frames with.
    pub shape: TrackShape,
    /// Outer size of the shape.
    pub dimensions: Dimensions,
    /// Covariance of the outer size (length, width, height) \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Total robust cost.
    pub cost: f64,
}

/// A frame during the solution.
struct Frame<'a> {
    problem: Problem<'a>,
    state: State,
    single: ShapeFit,
    swapped: bool,
    index: usize,
}

/// A frame's part of the normal equations: pose (6), shape (8).
struct Blocks {
    hpp: Matrix6<f64>,
    hps: SMatrix<f64, 6, MAX_SHAPE>,
    gp: Vector6<f64>,
}

/// Normal equations of a track: a block per frame, and that of the shape.
struct TrackNormal {
    frames: Vec<Blocks>,
    shape_h: ShapeMatrix,
    shape_g: Shape,
    cost: f64,
}

impl ShapeFitter {
    /// Poses of a vehicle in many images with one shape for all: every frame is first fitted alone, then all poses and the
    /// shape together, poses eliminated by the Schur complement. Unusable frames return their error; the size
    /// prior of the first usable frame enters once. [`FitError::NoSolution`] when no frame can be used.
    pub fn fit_track(
        &self,
        camera: &PinholeCamera,
        observations: &[Observation],
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
        let shape = frames.iter().fold(Shape::zeros(), |sum, f| sum + f.state.shape / count);
        frames.iter_mut().for_each(|f| f.state.shape = shape);

        let mut cost = self.solve(&mut frames, &mut rows);
        if self.turn_flipped(camera, observations, &mut frames, &mut rows) {
            cost = self.solve(&mut frames, &mut rows);
        }
        let (fits, covariance) = self.marginals(&frames, &mut rows)?;
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

    /// Levenberg–Marquardt over all poses and the shape; returns the cost.
    fn solve(&self, frames: &mut [Frame<'_>], rows: &mut Vec<Row>) -> f64 {
        let mut damping = 1e-3;
        let Some(mut normal) = self.linearise(frames, rows) else { return f64::INFINITY };
        for _ in 0..2 * self.options().max_iterations {
            let before: Vec<State> = frames.iter().map(|f| f.state).collect();
            let damped = |h: f64| h * (1.0 + damping) + 1e-9;
            // S = H_ss − Σ H_spᵢ H_ppᵢ⁻¹ H_psᵢ, and the same for the gradient.
            let mut s = normal.shape_h;
            let mut g = normal.shape_g;
            for k in 0..MAX_SHAPE {
                s[(k, k)] = damped(s[(k, k)]);
            }
            let mut eliminated = Vec::with_capacity(frames.len());
            for blocks in &normal.frames {
                let mut hpp = blocks.hpp;
                for k in 0..6 {
                    hpp[(k, k)] = damped(hpp[(k, k)]);
                }
                let Some(factor) = hpp.cholesky() else { break };
                s -= blocks.hps.transpose() * factor.solve(&blocks.hps);
                g -= blocks.hps.transpose() * factor.solve(&blocks.gp);
                eliminated.push(factor);
            }
            let solved = s.cholesky().filter(|_| eliminated.len() == frames.len()).map(|f| f.solve(&-g));
            let Some(shape_step) = solved else {
                damping *= 10.0;
                if damping > 1e8 {
                    break;
                }
                continue;
            };
            let shape = frames[0].state.shape + shape_step;
            for ((frame, blocks), factor) in frames.iter_mut().zip(&normal.frames).zip(&eliminated) {
                let pose_step = factor.solve(&-(blocks.gp + blocks.hps * shape_step));
                let mut delta = SVector::<f64, DOF>::zeros();
                delta.fixed_rows_mut::<6>(0).copy_from(&pose_step);
                frame.state = step(&frame.state, &delta);
                frame.state.shape = shape;
            }
            match self.linearise(frames, rows) {
                Some(there) if there.cost < normal.cost => {
                    let settled = normal.cost - there.cost < 1e-6 * (1.0 + there.cost);
                    normal = there;
                    damping = (damping * 0.1).max(1e-9);
                    if settled {
                        break;
                    }
                }
                _ => {
                    frames.iter_mut().zip(before).for_each(|(f, state)| f.state = state);
                    damping *= 10.0;
                    if damping > 1e8 {
                        break;
                    }
                }
            }
        }
        normal.cost
    }

    /// Normal equations of all frames and of the shape, with the total cost; `None` when a frame is behind the camera.
    fn linearise(&self, frames: &[Frame<'_>], rows: &mut Vec<Row>) -> Option<TrackNormal> {
        let first = frames.first()?;
        let (mut shape_h, mut shape_g, mut cost) = self.shape_terms(first, rows);
        let mut all = Vec::with_capacity(frames.len());
        for frame in frames {
            if !frame.problem.rows(&frame.state, rows) {
                return None;
            }
            let normal = Normal::of(&frame.problem, rows, |_| true);
            shape_h += normal.h.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6);
            shape_g += normal.g.fixed_rows::<MAX_SHAPE>(6);
            cost += normal.cost;
            all.push(Blocks {
                hpp: normal.h.fixed_view::<6, 6>(0, 0).into_owned(),
                hps: normal.h.fixed_view::<6, MAX_SHAPE>(0, 6).into_owned(),
                gp: normal.g.fixed_rows::<6>(0).into_owned(),
            });
        }
        Some(TrackNormal { frames: all, shape_h, shape_g, cost })
    }

    /// Shape and size prior at the shared shape; unused coefficients are held.
    fn shape_terms(&self, frame: &Frame<'_>, rows: &mut Vec<Row>) -> (ShapeMatrix, Shape, f64) {
        rows.clear();
        frame.problem.shape_rows(&frame.state, rows);
        let normal = Normal::of(&frame.problem, rows, |_| true);
        let mut h: ShapeMatrix = normal.h.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6).into_owned();
        for k in self.model.sigmas.len()..MAX_SHAPE {
            h[(k, k)] += 1.0;
        }
        (h, normal.g.fixed_rows::<MAX_SHAPE>(6).into_owned(), normal.cost)
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
            let now = cost_of(&frame.problem, rows) + self.penalty(frame.swapped);
            let swapped = opposite.sides_swapped;
            let observation = &observations[frame.index];
            let mut problem = Problem::new(&self.model, camera, self.options(), observation, swapped);
            problem.shape_terms = false;
            problem.distance_m = opposite.camera_from_vehicle.translation().z;
            let start = State { camera_from_vehicle: opposite.camera_from_vehicle, shape: frame.state.shape };
            let effort = Effort::full(self.options().max_iterations);
            let Some(there) = refine(&problem, start, Free::Pose, effort, rows) else { continue };
            if there.cost + self.penalty(swapped) + FLIP_GAIN < now {
                (frame.problem, frame.state, frame.swapped) = (problem, there.state, swapped);
                turned = true;
            }
        }
        turned
    }

    /// Covariances: `Σ_pp = H_pp⁻¹ + H_pp⁻¹ H_ps S⁻¹ H_sp H_pp⁻¹`, and that of the shape, S⁻¹.
    fn marginals(
        &self,
        frames: &[Frame<'_>],
        rows: &mut Vec<Row>,
    ) -> Result<(Vec<FrameFit>, ShapeMatrix), FitError> {
        let first = frames.first().ok_or(FitError::NoSolution)?;
        let (mut s, _, _) = self.shape_terms(first, rows);
        let mut parts = Vec::with_capacity(frames.len());
        for frame in frames {
            if !frame.problem.rows(&frame.state, rows) {
                return Err(FitError::NoSolution);
            }
            let quality = Quality::of(rows, frame.problem.model.keypoints);
            let cost = cost_of(&frame.problem, rows);
            let information = information(&frame.problem, rows, quality.scale());
            let hps = information.fixed_view::<6, MAX_SHAPE>(0, 6).into_owned();
            let factor =
                information.fixed_view::<6, 6>(0, 0).into_owned().cholesky().ok_or(FitError::NoSolution)?;
            s += information.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6);
            s -= hps.transpose() * factor.solve(&hps);
            parts.push((factor, hps, quality, cost));
        }
        let shape = s.cholesky().ok_or(FitError::NoSolution)?;
        let fit = |(frame, (factor, hps, quality, cost)): (&Frame<'_>, (_, _, Quality, f64))| {
            let factor: nalgebra::Cholesky<f64, nalgebra::U6> = factor;
            let gain: SMatrix<f64, 6, MAX_SHAPE> = factor.solve(&hps);
            let covariance = factor.inverse() + gain * shape.solve(&gain.transpose());
            let overruled = frame.single.opposite.is_some_and(|o| {
                let other = State { camera_from_vehicle: o.camera_from_vehicle, ..frame.state };
                super::hypotheses::heading_cosine(&other, &frame.state) > 0.0
            });
            let margin = frame.single.heading_margin();
            FrameFit {
                camera_from_vehicle: frame.state.camera_from_vehicle,
                covariance,
                inliers: quality.inliers,
                residual_sigma: quality.residual_sigma,
                sides_swapped: frame.swapped,
                cost,
                heading_margin: if overruled { -margin } else { margin },
            }
        };
        Ok((frames.iter().zip(parts).map(fit).collect(), shape.inverse()))
    }
}
