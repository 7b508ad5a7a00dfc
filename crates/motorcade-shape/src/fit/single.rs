//! One vehicle in one image.

use motorcade_geometry::robust::median;
use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, SMatrix};

use super::model::{Model, State};
use super::observation::Observation;
use super::options::{FitMethod, FitOptions};
use super::problem::{Problem, Row, Term};
use super::solver::{Effort, Free, Normal, Refined, refine};
use super::{DOF, MAX_SHAPE, hypotheses};
use crate::dimensions::Dimensions;
use crate::error::FitError;
use crate::prior::ShapePrior;

/// Keypoints needed on a known road: two points give place and size, visibility the heading.
const NEEDED_ON_ROAD: usize = 2;
/// Keypoints needed otherwise: six numbers of a pose and one to spare.
const NEEDED_FREE: usize = 4;
/// χ² of 2 degrees of freedom stays under this in 99 %.
const INLIER_CHI2: f64 = 9.21;
/// Median of χ² with 2 degrees of freedom.
const MEDIAN_CHI2: f64 = 1.386;
/// Cost difference below which the other heading stays possible: a factor of 100 in likelihood.
const CLEAR_COST: f64 = 9.2;

/// Another explanation of the same keypoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternative {
    /// Its pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Its cost, comparable with [`ShapeFit::cost`]: half the difference is the logarithm of the odds.
    pub cost: f64,
    /// Whether it takes left points for right ones.
    pub sides_swapped: bool,
}

/// Pose and shape of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeFit {
    /// Pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose (6×6 `[ω, ν]`, right perturbation, so in the vehicle frame), the shape marginalised; the
    /// image's part is widened where residuals are larger than their sigmas.
    pub covariance: Matrix6<f64>,
    /// Covariance of the outer size (length, width, height) \[m²\], and of the pose with it (6×3): a vehicle taken for too small is
    /// placed too near.
    pub size_covariance: Matrix3<f64>,
    /// See `size_covariance`.
    pub pose_size_covariance: Matrix6x3<f64>,
    /// Shape coefficients λ, one a used deformation of the prior.
    pub coefficients: Vec<f64>,
    /// Outer size of the shape.
    pub dimensions: Dimensions,
    /// Which keypoints count as measurements and agree (99 % gate), in the order of the observation.
    pub inliers: Vec<bool>,
    /// Robust standard deviation of the whitened keypoint residuals: 1 when they are as accurate as assumed.
    pub residual_sigma: f64,
    /// Final robust cost (no factor ½).
    pub cost: f64,
    /// Whether the network's left and right were exchanged.
    pub sides_swapped: bool,
    /// The best explanation whose heading differs by more than 90°, if there is one at all.
    pub opposite: Option<Alternative>,
    /// Steps of the solver over all hypotheses.
    pub iterations: usize,
}

impl ShapeFit {
    /// Cost by which the best heading beats the one that faces the other way; infinite when there is none.
    pub fn heading_margin(&self) -> f64 {
        self.opposite.map_or(f64::INFINITY, |o| o.cost - self.cost)
    }
    /// True when the vehicle may as well face the other way (odds under 100 to 1).
    pub fn heading_is_ambiguous(&self) -> bool {
        self.heading_margin() < CLEAR_COST
    }
}

/// Fits vehicles with one prior and one set of options.
#[derive(Clone, Debug)]
pub struct ShapeFitter {
    prior: ShapePrior,
    options: FitOptions,
    pub(super) model: Model,
}

impl ShapeFitter {
    /// Makes the prior ready.
    pub fn new(prior: ShapePrior, options: FitOptions) -> Self {
        let model = Model::new(&prior, options.deformations);
        Self { prior, options, model }
    }
    /// The prior.
    pub fn prior(&self) -> &ShapePrior {
        &self.prior
    }
    /// The options.
    pub fn options(&self) -> &FitOptions {
        &self.options
    }

    /// Pose and shape of one vehicle from one image (equations 6–8 of the paper).
    ///
    /// Headings over the circle, with the network's sides as given and exchanged, are placed linearly; the most likely ones
    /// are refined in pose and shape. Deterministic.
    pub fn fit(&self, camera: &PinholeCamera, observation: &Observation) -> Result<ShapeFit, FitError> {
        self.check(camera, observation)?;
        let mut rows = Vec::with_capacity(4 * self.model.points.len());
        let start = self.start_shape(observation);
        let chosen = hypotheses::choose(&self.model, camera, &self.options, observation, &start);

        // First roughly, all of them; then to the end those that may still win and the best that faces the other way.
        let mut iterations = 0;
        let mut rough: Vec<(Refined, bool)> = Vec::new();
        for hypothesis in chosen {
            let swapped = hypothesis.swapped;
            let mut problem = Problem::new(&self.model, camera, &self.options, observation, swapped);
            problem.distance_m = hypothesis.state.camera_from_vehicle.translation().z;
            let refined = refine(&problem, hypothesis.state, Free::All, Effort::ROUGH, &mut rows);
            let Some(mut refined) = refined else { continue };
            iterations += refined.iterations;
            refined.cost += self.penalty(swapped);
            rough.push((refined, swapped));
        }
        rough.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let first = rough.first().ok_or(FitError::NoSolution)?.0;
        let mut found: Vec<(Refined, bool)> = Vec::new();
        let mut turned = false;
        for (start, swapped) in rough {
            let away = hypotheses::heading_cosine(&start.state, &first.state) < 0.0;
            if start.cost > first.cost + CLEAR_COST && (!away || turned) {
                continue;
            }
            turned |= away;
            let mut problem = Problem::new(&self.model, camera, &self.options, observation, swapped);
            let Some(mut refined) = self.descend(&mut problem, start.state, &mut rows) else { continue };
            iterations += refined.iterations;
            refined.cost += self.penalty(swapped);
            found.push((refined, swapped));
        }
        let (best, swapped) =
            *found.iter().min_by(|a, b| a.0.cost.total_cmp(&b.0.cost)).ok_or(FitError::NoSolution)?;
        let opposite = found
            .iter()
            .filter(|(other, _)| hypotheses::heading_cosine(&other.state, &best.state) < 0.0)
            .min_by(|a, b| a.0.cost.total_cmp(&b.0.cost))
            .map(|(other, swapped)| Alternative {
                camera_from_vehicle: other.state.camera_from_vehicle,
                cost: other.cost,
                sides_swapped: *swapped,
            });
        let mut problem = Problem::new(&self.model, camera, &self.options, observation, swapped);
        problem.distance_m = best.state.camera_from_vehicle.translation().z;
        if !problem.rows(&best.state, &mut rows) {
            return Err(FitError::NoSolution);
        }
        let quality = Quality::of(&rows, observation.keypoints.len());
        let information = information(&problem, &rows, quality.scale());
        let covariance = information.cholesky().ok_or(FitError::NoSolution)?.inverse();
        let coefficients = self.model.coefficients(&best.state.shape);
        let (slope, shape) = (&self.model.size_slope, covariance.fixed_view::<MAX_SHAPE, MAX_SHAPE>(6, 6));
        Ok(ShapeFit {
            size_covariance: slope * shape * slope.transpose(),
            pose_size_covariance: covariance.fixed_view::<6, MAX_SHAPE>(0, 6) * slope.transpose(),
            camera_from_vehicle: best.state.camera_from_vehicle,
            covariance: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
            dimensions: self.prior.dimensions(&coefficients),
            coefficients,
            inliers: quality.inliers,
            residual_sigma: quality.residual_sigma,
            cost: best.cost,
            sides_swapped: swapped,
            opposite,
            iterations,
        })
    }

    pub(super) fn check(&self, camera: &PinholeCamera, observation: &Observation) -> Result<(), FitError> {
        camera.validate()?;
        observation.validate()?;
        let expected = self.model.keypoints;
        let found = observation.keypoints.len();
        if found != expected {
            return Err(FitError::KeypointCount { prior: self.prior.name().to_owned(), expected, found });
        }
        let min_confidence = self.options.min_confidence;
        let found = observation.keypoints.iter().filter(|k| k.confidence >= min_confidence).count();
        let needed = if observation.road.is_some() { NEEDED_ON_ROAD } else { NEEDED_FREE };
        if found < needed {
            return Err(FitError::TooFewKeypoints { found, needed, min_confidence });
        }
        Ok(())
    }

    /// Cost of an assignment of sides.
    pub(super) fn penalty(&self, swapped: bool) -> f64 {
        if swapped { self.options.swap_cost } else { 0.0 }
    }

    /// The likeliest shape before looking: that of the size, or the mean.
    pub(super) fn start_shape(&self, observation: &Observation) -> super::model::Shape {
        observation
            .size
            .map_or_else(Default::default, |size| self.model.whitened(&self.prior.coefficients_for(&size)))
    }

    /// Refines by the chosen method, twice: the second time with metre sigmas at the distance that was found.
    fn descend(&self, problem: &mut Problem<'_>, state: State, rows: &mut Vec<Row>) -> Option<Refined> {
        let effort = Effort::full(self.options.max_iterations);
        let mut out = Refined { state, cost: f64::INFINITY, iterations: 0 };
        for _ in 0..2 {
            problem.distance_m = out.state.camera_from_vehicle.translation().z;
            let parts: &[Free] = match self.options.method {
                FitMethod::Joint => &[Free::All],
                FitMethod::Alternating { .. } => &[Free::Pose, Free::Shape],
            };
            let rounds = match self.options.method {
                FitMethod::Joint => 1,
                FitMethod::Alternating { rounds } => rounds,
            };
            for free in (0..rounds).flat_map(|_| parts) {
                let refined = refine(problem, out.state, *free, effort, rows)?;
                out = Refined { iterations: out.iterations + refined.iterations, ..refined };
            }
        }
        Some(out)
    }
}

/// How well keypoints agree with a fit.
pub(super) struct Quality {
    pub inliers: Vec<bool>,
    pub residual_sigma: f64,
}

impl Quality {
    pub fn of(rows: &[Row], keypoints: usize) -> Self {
        let mut squares: Vec<(usize, f64)> = Vec::new();
        for row in rows {
            if let Term::Keypoint(seen) = row.term {
                match squares.last_mut() {
                    Some((last, s)) if *last == seen => *s += row.r * row.r,
                    _ => squares.push((seen, row.r * row.r)),
                }
            }
        }
        let mut inliers = vec![false; keypoints];
        for (seen, s) in &squares {
            inliers[*seen] = *s < INLIER_CHI2;
        }
        let mut values: Vec<f64> = squares.into_iter().map(|(_, s)| s).collect();
        let residual_sigma = (median(&mut values).unwrap_or(0.0) / MEDIAN_CHI2).sqrt();
        Self { inliers, residual_sigma }
    }

    /// Factor on the image's sigmas. Never below 1: with few points residuals are small because the fit follows them.
    pub fn scale(&self) -> f64 {
        self.residual_sigma.max(1.0)
    }
}

/// Information of pose and shape (14×14): the image's part at widened sigmas, and what was known before. A floor (half a
/// turn, 100 m) stands in for what nothing determines.
pub(super) fn information(problem: &Problem<'_>, rows: &[Row], scale: f64) -> SMatrix<f64, DOF, DOF> {
    let image = Normal::of(problem, rows, Term::is_image);
    let known = Normal::of(problem, rows, |t| !t.is_image());
    let mut information = image.h / (scale * scale) + known.h;
    for k in 0..3 {
        information[(k, k)] += 1.0 / (std::f64::consts::PI * std::f64::consts::PI);
        information[(3 + k, 3 + k)] += 1e-4;
    }
    for k in 6 + problem.model.sigmas.len()..DOF {
        information[(k, k)] += 1.0;
    }
    information
}
