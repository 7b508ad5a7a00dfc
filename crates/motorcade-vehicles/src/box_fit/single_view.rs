//! Result of the fit of a vehicle to one box, with its sensitivities.

use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

/// Position and size of a vehicle from one box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleView {
    /// Bottom centre, camera frame \[m\].
    pub position_in_camera: Point3<f64>,
    /// Covariance of the position (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Size.
    pub size: Dimensions,
    /// Squared whitened residual of the edges.
    pub chi2: f64,
    /// Twice the negative logarithm of the likelihood of edges and road, up to a constant: to compare noise models.
    pub(crate) cost: f64,
    /// Normal matrix in (ahead, left, above | l, w, h) without the size prior (6×6), to combine the frames of a track.
    pub(crate) information: Matrix6<f64>,
    /// Gradient in the same order, without the size prior.
    pub(crate) gradient: Vector6<f64>,
    /// Solution in the same order.
    pub(crate) state: Vector6<f64>,
    /// Derivative of the gradient by the heading.
    pub(super) gradient_by_heading: Vector6<f64>,
    /// Derivative of the gradient by the height of the road there.
    pub(super) gradient_by_road: Vector6<f64>,
    /// Columns ahead, left, above in the camera frame (3×3).
    pub(super) axes: Matrix3<f64>,
}

impl SingleView {
    /// χ² of the edges and of the size against its prior.
    pub(crate) fn chi2_with_size(&self, prior: &SizePrior) -> f64 {
        let difference = self.size.to_vector() - prior.mean.to_vector();
        self.chi2 + difference.component_div(&prior.sigma.to_vector()).norm_squared()
    }

    /// Derivative of the position by the mean of the size prior (3×3, camera frame, m per m), by the implicit function theorem
    /// on the normal equations with the prior's information W:
    ///
    /// ```text
    /// H = [H_pp, H_ps; H_sp, H_ss + W]     ∂p/∂mean = (H⁻¹)_ps W  (→ −H_pp⁻¹ H_ps for a size that is held)
    /// ```
    pub(crate) fn position_by_size(&self, size_information: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        let inverse = self.inverse(size_information)?;
        Some(self.axes * inverse.fixed_view::<3, 3>(0, 3) * size_information)
    }

    /// Derivative of the position by the heading (camera frame, m per rad): −(H⁻¹ ∂g/∂heading)_p, H as in
    /// [`SingleView::position_by_size`]. A vehicle turned further shows more of its side, and a box of the same width is then
    /// further away: half a metre for 3° at 18 m.
    pub(crate) fn position_by_heading(&self, size_information: &Matrix3<f64>) -> Option<Vector3<f64>> {
        let slope = self.inverse(size_information)? * self.gradient_by_heading;
        Some(self.axes * -slope.fixed_rows::<3>(0))
    }

    /// Derivative of the position by the height of the road under the vehicle (camera frame, m per m): on a road that is higher than assumed the vehicle is
    /// nearer.
    pub(crate) fn position_by_road(&self, size_information: &Matrix3<f64>) -> Option<Vector3<f64>> {
        let slope = self.inverse(size_information)? * self.gradient_by_road;
        Some(self.axes * -slope.fixed_rows::<3>(0))
    }

    fn inverse(&self, size_information: &Matrix3<f64>) -> Option<Matrix6<f64>> {
        let mut h = self.information;
        let mut block = h.fixed_view_mut::<3, 3>(3, 3);
        block += size_information;
        Some(h.cholesky()?.inverse())
    }
}
