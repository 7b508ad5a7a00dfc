//! Brown–Conrady distortion.

use super::LARGEST_R2;
use crate::polynomial::first_positive_root;

/// Brown–Conrady distortion (Brown, Photogrammetric Engineering 1971), OpenCV's first five coefficients. With r² = x² + y²:
///
/// x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
/// y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadialTangential {
    /// Radial r².
    pub k1: f64,
    /// Radial r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial r⁶.
    pub k3: f64,
}

impl RadialTangential {
    /// Distorted position of the ray (x, y, 1), in normalised coordinates.
    #[inline]
    pub fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let dx = 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x);
        let dy = self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y;
        (x * radial + dx, y * radial + dy)
    }
    /// Radial part at a distance r from the middle.
    pub(super) fn radius(&self, r: f64) -> f64 {
        let r2 = r * r;
        r * (1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3)))
    }
    /// r² up to which the radial part grows: d/dr = 1 + 3 k1 r² + 5 k2 r⁴ + 7 k3 r⁶ = 0; `None` when it always does.
    pub(super) fn largest_r2(&self) -> Option<f64> {
        first_positive_root(&[1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3], LARGEST_R2)
    }
}
