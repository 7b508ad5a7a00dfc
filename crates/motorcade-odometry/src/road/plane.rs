//! The road plane and its coordinates.

use nalgebra::{Matrix4, Vector3, Vector4};

/// The road as the alignment of pixels finds it, in the current camera frame and the odometry's unit of length. Not a
/// [`RoadPlane`](motorcade_geometry::RoadPlane): that one is metric and flat, and height and normal are not what pixels measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignedRoad {
    /// m (3×1) with `mᵀX = 1` for points X on the road.
    pub m: Vector3<f64>,
    /// Vertical curvature over twice the camera's height, c in `1/z = mᵀx + c/(mᵀx)`.
    pub curvature: f64,
    /// Covariance of m and curvature (4×4).
    pub covariance: Matrix4<f64>,
    /// Standard deviation of curvature times height in the prior.
    pub prior_curvature_sigma: f64,
    /// Pixels used.
    pub pixels: usize,
    /// Share of them that agree.
    pub agreement: f64,
    /// Standard deviation of the grey residual \[grey levels\].
    pub sigma_grey: f64,
}

/// Unit normal of the road towards the camera, in the camera frame, from pitch and roll.
///
/// Pitch turns the far road up (a camera looking down has positive pitch), roll tips it sideways:
/// `n ∝ −(tan roll, 1, tan pitch)`.
pub fn road_normal(pitch_rad: f64, roll_rad: f64) -> Vector3<f64> {
    -Vector3::new(roll_rad.tan(), 1.0, pitch_rad.tan()).normalize()
}

/// Pitch and roll \[rad\] of a normal of the road in the camera frame, of either sign and any length; see [`road_normal`].
pub fn road_tilt(normal: &Vector3<f64>) -> (f64, f64) {
    ((normal.z / normal.y).atan(), (normal.x / normal.y).atan())
}

/// `[log|m|, pitch, roll, curvature · height]` of a plane m with curvature c, and its Jacobian by both (4×4).
pub(super) fn coordinates(m: &Vector3<f64>, curvature: f64) -> (Vector4<f64>, Matrix4<f64>) {
    let norm2 = m.norm_squared();
    // c = κ/(2d) and the camera's height d = 1/|m|.
    let height_curvature = 2.0 * curvature / norm2;
    let (pitch, roll) = road_tilt(m);
    let value = Vector4::new(0.5 * norm2.ln(), pitch, roll, height_curvature);
    let (yz, yx) = (m.y * m.y + m.z * m.z, m.y * m.y + m.x * m.x);
    let by_norm = -2.0 * height_curvature / norm2;
    #[rustfmt::skip]
    let jacobian = Matrix4::new(
        m.x / norm2,   m.y / norm2,   m.z / norm2,   0.0,
        0.0,           -m.z / yz,     m.y / yz,      0.0,
        m.y / yx,      -m.x / yx,     0.0,           0.0,
        by_norm * m.x, by_norm * m.y, by_norm * m.z, 2.0 / norm2,
    );
    (value, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::numeric::jacobian_error;
    use nalgebra::{DMatrix, DVector};
    use std::convert::Infallible;

    #[test]
    fn coordinates_match_their_jacobian_and_the_normal() {
        let (m, curvature) = (Vector3::new(0.01, 0.55, 0.02), 4e-4);
        let (value, jacobian) = coordinates(&m, curvature);
        let analytic = DMatrix::from_column_slice(4, 4, jacobian.as_slice());
        let off = jacobian_error(&analytic, |step| {
            let moved = m + step.fixed_rows::<3>(0);
            let moved = coordinates(&moved, curvature + step[3]).0;
            Ok::<_, Infallible>(DVector::from_column_slice(moved.as_slice()))
        });
        assert!(off.unwrap() < 1e-6);
        assert!((road_normal(value.y, value.z) + m.normalize()).norm() < 1e-12);
    }
}
