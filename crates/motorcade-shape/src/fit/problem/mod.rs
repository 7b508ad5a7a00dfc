//! The cost of a pose and a shape as whitened residuals with analytic Jacobians: the paper's equations 7 and 8, and further terms.
//!
//! ```text
//! Σ_i ρ( c_i |π(R X_i(λ) + t) − x_i|²_Σi )     keypoints, c_i the confidence          (7, 8)
//! + Σ_b λ_b² / variance_b                      shape prior
//! + ((up·t + h)/σ_h)² + |lean|²/σ²             upright on the road
//! + |size(λ) − mean|²_Σ                        size of the class
//! + Σ_i ρ_v(cosine of the face / σ)            visibility
//! ```
//!
//! Tangent of a state: `[ω, ν, shape]`, perturbation of the pose on the right, shape whitened.

mod image;
mod placement;
mod priors;
#[cfg(test)]
mod tests;
mod visibility;

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Matrix3, Point2, SVector, Vector2, Vector3};

use super::DOF;
use super::heading::HeadingEvidence;
use super::model::{Model, State};
use super::observation::{MeasuredRoad, Observation};
use super::options::FitOptions;
use crate::dimensions::SizePrior;

/// Smallest depth of a point: nearer ones have no meaningful image \[m\].
const NEAREST_M: f64 = 0.5;

/// Kind of a residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Term {
    /// Keypoint (its index in the observation); two rows each, x then y.
    Keypoint(usize),
    /// Saturates at the given cost.
    Visibility(f64),
    /// Height over the road, lean.
    Road,
    /// Size of the class.
    Size,
    /// Shape prior.
    Shape,
}

impl Term {
    /// True for measurements in the image, false for prior knowledge.
    pub fn is_image(self) -> bool {
        matches!(self, Self::Keypoint(_) | Self::Visibility(_))
    }
}

/// A whitened residual and its Jacobian by `[ω, ν, shape]` (14).
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub term: Term,
    pub r: f64,
    pub j: SVector<f64, DOF>,
}

/// A measured keypoint.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// Index in the observation.
    index: usize,
    /// Index in the model, which differs when sides are swapped.
    point: usize,
    pixel: Point2<f64>,
    /// Variance along x and y, confidence included \[px²\].
    variance: Vector2<f64>,
}

/// One vehicle in one image, for one assignment of sides.
pub(crate) struct Problem<'a> {
    pub model: &'a Model,
    pub camera: &'a PinholeCamera,
    pub options: &'a FitOptions,
    measured: Vec<Measured>,
    /// Model points that were not found.
    missing: Vec<usize>,
    road: Option<MeasuredRoad>,
    size: Option<SizePrior>,
    heading: Option<HeadingEvidence>,
    swapped: bool,
    /// Distance at which metre sigmas are converted to pixels; constant during a refinement, because a growing distance would
    /// lower the cost.
    pub distance_m: f64,
    /// True when shape prior and size are part of the cost; in a track they count once, not in every frame.
    pub shape_terms: bool,
}

impl<'a> Problem<'a> {
    pub fn new(
        model: &'a Model,
        camera: &'a PinholeCamera,
        options: &'a FitOptions,
        observation: &Observation,
        swapped: bool,
    ) -> Self {
        let (mut measured, mut missing) = (Vec::new(), Vec::new());
        for (index, keypoint) in observation.keypoints.iter().enumerate() {
            let point = if swapped { model.mirror[index] } else { index };
            if keypoint.confidence >= options.min_confidence {
                // The confidence is the weight, as in the paper: measured errors grow as the root of 1/confidence (3, 4, 6 px
                // of 64 at 0.7, 0.4, 0.2).
                let sigma_px = keypoint.sigma_px.unwrap_or(observation.sigma_px);
                let variance = sigma_px.map(|s| s * s / keypoint.confidence);
                measured.push(Measured { index, point, pixel: keypoint.pixel, variance });
            } else {
                missing.push(point);
            }
        }
        Self {
            model,
            camera,
            options,
            measured,
            missing,
            road: observation.road,
            size: observation.size,
            heading: observation.heading.clone(),
            swapped,
            distance_m: options.advanced.start_distance_m,
            shape_terms: true,
        }
    }

    /// Unit normal of the road towards the camera (camera frame).
    pub fn up(&self) -> Vector3<f64> {
        self.road.map_or_else(|| -Vector3::y(), |r| r.plane.up)
    }

    /// Cost of what hypotheses differ in and refinement does not change: the assignment of sides, and the heading by a network.
    pub fn discrete_cost(&self, state: &State) -> f64 {
        let swap = if self.swapped { self.options.swap_cost } else { 0.0 };
        let unrelated = self.options.advanced.heading_unrelated;
        let heading = |h: &HeadingEvidence| h.cost(&state.camera_from_vehicle, &self.up(), unrelated);
        swap + self.heading.as_ref().map_or(0.0, heading)
    }

    /// Whitened rows of all residuals at a state; false when a keypoint is behind the camera.
    pub fn rows(&self, state: &State, rows: &mut Vec<Row>) -> bool {
        rows.clear();
        let pose = &state.camera_from_vehicle;
        let (rotation, translation) = (pose.rotation_matrix(), pose.translation());
        let ok = self.keypoint_rows(state, &rotation, &translation, rows);
        self.visibility_rows(state, &rotation, rows);
        self.road_rows(&rotation, &translation, rows);
        if self.shape_terms {
            self.shape_rows(state, rows);
        }
        ok && translation.z > NEAREST_M
    }

    /// Kernel of a term: cost ρ(s) and weight ρ'(s) of a squared whitened residual.
    pub fn robust(&self, term: Term, s: f64) -> (f64, f64) {
        match term {
            Term::Keypoint(_) => (self.options.kernel().cost(s), self.options.kernel().weight(s)),
            // Geman–McClure: the cost of one point saturates.
            Term::Visibility(most) => (most * s / (1.0 + s), most / (1.0 + s).powi(2)),
            Term::Road | Term::Size | Term::Shape => (s, 1.0),
        }
    }
}

/// Pose from a rotation and a translation.
pub(crate) fn pose(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Pose<Camera, Vehicle> {
    Pose::from_matrix(rotation, translation)
}
