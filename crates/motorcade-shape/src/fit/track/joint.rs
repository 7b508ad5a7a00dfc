//! Joint solution of a track: poses eliminated by the Schur complement.

use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

use super::super::fitter::ShapeFitter;
use super::super::hypotheses::heading_cosine;
use super::super::model::{Shape, State};
use super::super::problem::{Problem, Row};
use super::super::quality::{Quality, information};
use super::super::result::ShapeFit;
use super::super::solver::{Normal, cost_of, step};
use super::super::track_shape::ShapeMatrix;
use super::super::{DOF, MAX_SHAPE};
use super::result::FrameFit;
use crate::error::FitError;

/// A frame during the solution.
pub(super) struct Frame<'a> {
    pub(super) problem: Problem<'a>,
    pub(super) state: State,
    pub(super) single: ShapeFit,
    pub(super) swapped: bool,
    pub(super) index: usize,
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
    /// Levenberg–Marquardt over all poses and the shape; returns the cost. The prior of the shape counts `repeated` times: what the
    /// frames show of it together is less certain by that factor of variance.
    pub(super) fn solve(&self, frames: &mut [Frame<'_>], repeated: f64, rows: &mut Vec<Row>) -> f64 {
        let mut damping = 1e-3;
        let Some(mut normal) = self.linearise(frames, repeated, rows) else { return f64::INFINITY };
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
                frame.state = step(&frame.state, &delta, &self.options().advanced);
                frame.state.shape = shape;
            }
            match self.linearise(frames, repeated, rows) {
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
    fn linearise(&self, frames: &[Frame<'_>], repeated: f64, rows: &mut Vec<Row>) -> Option<TrackNormal> {
        let first = frames.first()?;
        let (mut shape_h, mut shape_g, mut cost) = self.shape_terms(first, repeated, rows);
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

    /// Shape and size prior at the shared shape, `repeated` times; unused coefficients are held.
    fn shape_terms(
        &self,
        frame: &Frame<'_>,
        repeated: f64,
        rows: &mut Vec<Row>,
    ) -> (ShapeMatrix, Shape, f64) {
        rows.clear();
        frame.problem.shape_rows(&frame.state, rows);
        let normal = Normal::of(&frame.problem, rows, |_| true);
        let mut h: ShapeMatrix = normal.h.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6).into_owned();
        for k in self.model.sigmas.len()..MAX_SHAPE {
            h[(k, k)] += 1.0;
        }
        (h * repeated, normal.g.fixed_rows::<MAX_SHAPE>(6) * repeated, normal.cost * repeated)
    }

    /// Covariances: `Σ_pp = H_pp⁻¹ + H_pp⁻¹ H_ps Σ_ss H_sp H_pp⁻¹`, and that of the shape, Σ_ss = `repeated` · S⁻¹.
    pub(super) fn marginals(
        &self,
        frames: &[Frame<'_>],
        repeated: f64,
        rows: &mut Vec<Row>,
    ) -> Result<(Vec<FrameFit>, ShapeMatrix), FitError> {
        let first = frames.first().ok_or(FitError::NoSolution)?;
        let (mut s, _, _) = self.shape_terms(first, repeated, rows);
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
            let covariance = factor.inverse() + gain * shape.solve(&gain.transpose()) * repeated;
            let overruled = frame.single.opposite.is_some_and(|o| {
                let other = State { camera_from_vehicle: o.camera_from_vehicle, ..frame.state };
                heading_cosine(&other, &frame.state) > 0.0
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
        Ok((frames.iter().zip(parts).map(fit).collect(), shape.inverse() * repeated))
    }
}
