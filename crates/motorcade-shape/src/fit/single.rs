//! One vehicle in one image.

use motorcade_geometry::robust::median;
use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, SMatrix};

use super::DOF;
use super::model::Model;
use super::observation::Observation;
use super::options::FitOptions;
use super::problem::{Problem, Row, Term};
use super::search::Search;
use super::solver::Normal;
use super::track_shape::TrackShape;
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
pub(super) const CLEAR_COST: f64 = 9.2;

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
        let search = Search { fitter: self, camera, observation, known: None };
        search.run(&self.start_shape(observation))
    }

    /// As [`ShapeFitter::fit`] for a vehicle whose shape is that of its track: the pose is sought with the shape held
    /// (equation 7), and what is still uncertain of the shape enters the covariances.
    pub fn fit_shaped(
        &self,
        camera: &PinholeCamera,
        observation: &Observation,
        shape: &TrackShape,
    ) -> Result<ShapeFit, FitError> {
        Search { fitter: self, camera, observation, known: Some(shape) }.run(&shape.mean)
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
