//! Search for the most likely pose of one vehicle in one image.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix6, SMatrix};

use super::fitter::ShapeFitter;
use super::model::{Shape, State};
use super::observation::Observation;
use super::options::FitMethod;
use super::problem::{Problem, Row};
use super::quality::{Quality, information};
use super::result::{Alternative, CLEAR_COST, ShapeFit};
use super::solver::{Effort, Free, Refined, refine};
use super::track_shape::{ShapeMatrix, TrackShape};
use super::{MAX_SHAPE, hypotheses};
use crate::error::FitError;

/// One vehicle in one image, and the shape of its track if known.
pub(super) struct Search<'a> {
    pub fitter: &'a ShapeFitter,
    pub camera: &'a PinholeCamera,
    pub observation: &'a Observation,
    pub known: Option<&'a TrackShape>,
}

/// A minimum, and true when left and right are exchanged.
type Found = (Refined, bool);

/// Covariances at a minimum: pose (6×6), pose with shape (6×8), shape (8×8, whitened).
struct Spread {
    pose: Matrix6<f64>,
    pose_shape: SMatrix<f64, 6, MAX_SHAPE>,
    shape: ShapeMatrix,
}

impl<'a> Search<'a> {
    /// Searches headings and sides from this initial shape.
    pub fn run(&self, start: &Shape) -> Result<ShapeFit, FitError> {
        let Self { fitter, camera, observation, .. } = *self;
        fitter.check(camera, observation)?;
        let mut rows = Vec::with_capacity(4 * fitter.model.points.len());
        let mut iterations = 0;
        let rough = self.roughly(start, &mut iterations, &mut rows);
        let found = self.to_the_end(&rough, &mut iterations, &mut rows)?;
        let cheapest = |a: &&Found, b: &&Found| a.0.cost.total_cmp(&b.0.cost);
        let (best, swapped) = *found.iter().min_by(cheapest).ok_or(FitError::NoSolution)?;
        let away = |(other, _): &&Found| hypotheses::heading_cosine(&other.state, &best.state) < 0.0;
        let opposite = found.iter().filter(away).min_by(cheapest).map(|(other, swapped)| Alternative {
            camera_from_vehicle: other.state.camera_from_vehicle,
            cost: other.cost,
            sides_swapped: *swapped,
        });
        let mut problem = self.problem(swapped);
        problem.distance_m = best.state.camera_from_vehicle.translation().z;
        if !problem.rows(&best.state, &mut rows) {
            return Err(FitError::NoSolution);
        }
        let quality = Quality::of(&rows, observation.keypoints.len());
        let spread = self.spread(&problem, &rows, quality.scale())?;
        let coefficients = fitter.model.coefficients(&best.state.shape);
        let slope = &fitter.model.size_slope;
        Ok(ShapeFit {
            size_covariance: slope * spread.shape * slope.transpose(),
            pose_size_covariance: spread.pose_shape * slope.transpose(),
            camera_from_vehicle: best.state.camera_from_vehicle,
            covariance: spread.pose,
            dimensions: fitter.prior().dimensions(&coefficients),
            coefficients,
            inliers: quality.inliers,
            residual_sigma: quality.residual_sigma,
            cost: best.cost,
            sides_swapped: swapped,
            opposite,
            iterations,
        })
    }

    fn problem(&self, swapped: bool) -> Problem<'a> {
        let Self { fitter, camera, observation, known } = *self;
        let mut problem = Problem::new(&fitter.model, camera, fitter.options(), observation, swapped);
        problem.shape_terms = known.is_none();
        problem
    }

    /// All hypotheses after a rough refinement, the most likely first.
    fn roughly(&self, start: &Shape, iterations: &mut usize, rows: &mut Vec<Row>) -> Vec<Found> {
        let Self { fitter, camera, observation, .. } = *self;
        let chosen = hypotheses::choose(&fitter.model, camera, fitter.options(), observation, start);
        let free = if self.known.is_some() { Free::Pose } else { Free::All };
        let mut rough: Vec<Found> = Vec::new();
        for hypothesis in chosen {
            let swapped = hypothesis.swapped;
            let mut problem = self.problem(swapped);
            problem.distance_m = hypothesis.state.camera_from_vehicle.translation().z;
            let Some(mut refined) = refine(&problem, hypothesis.state, free, Effort::ROUGH, rows) else {
                continue;
            };
            *iterations += refined.iterations;
            refined.cost += problem.discrete_cost(&refined.state);
            rough.push((refined, swapped));
        }
        rough.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        rough
    }

    /// The hypotheses that may still be best, and the best opposite one, fully refined.
    fn to_the_end(
        &self,
        rough: &[Found],
        iterations: &mut usize,
        rows: &mut Vec<Row>,
    ) -> Result<Vec<Found>, FitError> {
        let first = rough.first().ok_or(FitError::NoSolution)?.0;
        let mut found: Vec<Found> = Vec::new();
        let mut turned = false;
        for (start, swapped) in rough {
            let away = hypotheses::heading_cosine(&start.state, &first.state) < 0.0;
            if start.cost > first.cost + CLEAR_COST && (!away || turned) {
                continue;
            }
            turned |= away;
            let mut problem = self.problem(*swapped);
            let Some(mut refined) = self.descend(&mut problem, start.state, rows) else { continue };
            *iterations += refined.iterations;
            refined.cost += problem.discrete_cost(&refined.state);
            found.push((refined, *swapped));
        }
        Ok(found)
    }

    /// Refines by the selected method, twice: the second time with metre sigmas at the estimated distance.
    fn descend(&self, problem: &mut Problem<'_>, state: State, rows: &mut Vec<Row>) -> Option<Refined> {
        let options = self.fitter.options();
        let effort = Effort::full(options.max_iterations);
        let (parts, rounds): (&[Free], usize) = match (self.known, options.method) {
            (Some(_), _) => (&[Free::Pose], 1),
            (None, FitMethod::Joint) => (&[Free::All], 1),
            (None, FitMethod::Alternating) => (&[Free::Pose, Free::Shape], options.rounds),
        };
        let mut out = Refined { state, cost: f64::INFINITY, iterations: 0 };
        for _ in 0..2 {
            problem.distance_m = out.state.camera_from_vehicle.translation().z;
            for free in (0..rounds).flat_map(|_| parts) {
                let refined = refine(problem, out.state, *free, effort, rows)?;
                out = Refined { iterations: out.iterations + refined.iterations, ..refined };
            }
        }
        Some(out)
    }

    /// With a known shape of covariance Σ the pose follows it by `G = −H_pp⁻¹ H_ps`: its covariance is `H_pp⁻¹ + G Σ Gᵀ`.
    fn spread(&self, problem: &Problem<'_>, rows: &[Row], scale: f64) -> Result<Spread, FitError> {
        let information = information(problem, rows, scale);
        let Some(known) = self.known else {
            let covariance = information.cholesky().ok_or(FitError::NoSolution)?.inverse();
            return Ok(Spread {
                pose: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
                pose_shape: covariance.fixed_view::<6, MAX_SHAPE>(0, 6).into_owned(),
                shape: covariance.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6).into_owned(),
            });
        };
        let pose: Matrix6<f64> = information.fixed_view::<6, 6>(0, 0).into_owned();
        let pose = pose.cholesky().ok_or(FitError::NoSolution)?;
        let follows: SMatrix<f64, 6, MAX_SHAPE> =
            -pose.solve(&information.fixed_view::<6, MAX_SHAPE>(0, 6).into_owned());
        let pose_shape = follows * known.covariance;
        Ok(Spread {
            pose: pose.inverse() + pose_shape * follows.transpose(),
            pose_shape,
            shape: known.covariance,
        })
    }
}
