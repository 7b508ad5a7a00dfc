//! The one shape of a vehicle that all frames of its track share.

use nalgebra::SMatrix;

use super::MAX_SHAPE;
use super::model::Shape;

/// Covariance of whitened shapes.
pub(crate) type ShapeMatrix = SMatrix<f64, MAX_SHAPE, MAX_SHAPE>;

/// A shape and its covariance, for [`ShapeFitter::fit_shaped`](super::ShapeFitter::fit_shaped) of the same fitter.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrackShape {
    /// Whitened coefficients λ_b / σ_b.
    pub(super) mean: Shape,
    /// Their covariance, the poses marginalised.
    pub(super) covariance: ShapeMatrix,
}
