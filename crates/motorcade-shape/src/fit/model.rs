//! A shape prior prepared for fitting: whitened, truncated, in flat arrays.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::{SMatrix, SVector, Vector3};

use super::MAX_SHAPE;
use crate::prior::ShapePrior;

/// Whitened shape coefficients: λ_b / σ_b; unused ones stay 0.
pub(crate) type Shape = SVector<f64, MAX_SHAPE>;

/// Pose and shape of one vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    pub shape: Shape,
}

/// One point with its displacements for one standard deviation of each deformation.
#[derive(Clone, Debug)]
pub(crate) struct ModelPoint {
    pub mean: Vector3<f64>,
    pub basis: SMatrix<f64, 3, MAX_SHAPE>,
}

impl ModelPoint {
    /// Position in the vehicle frame.
    pub fn at(&self, shape: &Shape) -> Vector3<f64> {
        let mut out = self.mean;
        for b in 0..MAX_SHAPE {
            for axis in 0..3 {
                out[axis] += self.basis[(axis, b)] * shape[b];
            }
        }
        out
    }
}

/// The prior in the form of the solver.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    /// The keypoints.
    pub points: Vec<ModelPoint>,
    pub keypoints: usize,
    pub faces: Vec<Vec<Vector3<f64>>>,
    pub mirror: Vec<usize>,
    /// (length, width, height) of the mean and its slopes in the whitened shape.
    pub size_mean: Vector3<f64>,
    pub size_slope: SMatrix<f64, 3, MAX_SHAPE>,
    /// σ_b of the used deformations.
    pub sigmas: Vec<f64>,
}

impl Model {
    pub fn new(prior: &ShapePrior, deformations: usize) -> Self {
        let used = deformations.min(MAX_SHAPE).min(prior.basis().len());
        let sigmas: Vec<f64> = prior.basis()[..used].iter().map(|d| d.variance.sqrt()).collect();
        let points = prior
            .mean()
            .iter()
            .take(prior.keypoints().len())
            .enumerate()
            .map(|(i, mean)| {
                let mut basis = SMatrix::<f64, 3, MAX_SHAPE>::zeros();
                for b in 0..used {
                    basis.set_column(b, &(prior.basis()[b].displacements[i] * sigmas[b]));
                }
                ModelPoint { mean: mean.coords, basis }
            })
            .collect();
        let mut size_slope = SMatrix::<f64, 3, MAX_SHAPE>::zeros();
        for b in 0..used {
            size_slope.set_column(b, &(prior.dimension_slope(b) * sigmas[b]));
        }
        Self {
            points,
            keypoints: prior.keypoints().len(),
            faces: prior.keypoints().iter().map(|k| k.faces.clone()).collect(),
            mirror: prior.keypoints().iter().map(|k| k.mirror).collect(),
            size_mean: prior.dimensions(&[]).to_vector(),
            size_slope,
            sigmas,
        }
    }

    /// Coefficients λ of a whitened shape.
    pub fn coefficients(&self, shape: &Shape) -> Vec<f64> {
        self.sigmas.iter().enumerate().map(|(b, sigma)| shape[b] * sigma).collect()
    }
    /// Whitened shape of coefficients λ.
    pub fn whitened(&self, coefficients: &[f64]) -> Shape {
        let mut shape = Shape::zeros();
        for (b, (sigma, lambda)) in self.sigmas.iter().zip(coefficients).enumerate() {
            shape[b] = lambda / sigma;
        }
        shape
    }
}
