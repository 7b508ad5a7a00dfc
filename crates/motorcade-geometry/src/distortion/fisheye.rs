//! Kannala–Brandt fisheye projection.

use std::f64::consts::PI;

use crate::polynomial::first_positive_root;

/// Fisheye projection by a polynomial of the angle (Kannala and Brandt, PAMI 2006, eq. 6 with the factor of θ as focal length), OpenCV's
/// `fisheye` with four coefficients. A ray at the angle θ from the optical axis is seen at the distance
///
/// r(θ) = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
///
/// from the middle. Coefficients 0 are the equidistant projection r = θ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fisheye {
    /// θ³.
    pub k1: f64,
    /// θ⁵.
    pub k2: f64,
    /// θ⁷.
    pub k3: f64,
    /// θ⁹.
    pub k4: f64,
}

impl Fisheye {
    /// Distorted position of the ray (x, y, 1), in normalised coordinates.
    #[inline]
    pub fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r = x.hypot(y);
        // r(θ)/r is 1 − r²/3 + .. near the axis: 1 to the last digit below 1e-8.
        let scale = if r < 1e-8 { 1.0 } else { self.radius(r.atan()) / r };
        (x * scale, y * scale)
    }
    /// r(θ).
    #[inline]
    pub fn radius(&self, angle_rad: f64) -> f64 {
        let t2 = angle_rad * angle_rad;
        angle_rad * (1.0 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4))))
    }
    /// θ up to which r(θ) grows, at most π \[rad\].
    pub(super) fn largest_angle_rad(&self) -> f64 {
        let slope = [1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3, 9.0 * self.k4];
        first_positive_root(&slope, PI * PI).map_or(PI, f64::sqrt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_coefficients_it_is_equidistant() {
        let (x, y) = Fisheye::default().distort(3.0, 4.0);
        assert!((x.hypot(y) - 5.0_f64.atan()).abs() < 1e-15 && (y / x - 4.0 / 3.0).abs() < 1e-15);
        assert_eq!(Fisheye::default().distort(0.0, 0.0), (0.0, 0.0));
        assert_eq!(Fisheye::default().largest_angle_rad(), PI);
    }

    #[test]
    fn a_polynomial_that_turns_ends_there() {
        // 1 − 3 · 0.1 θ² = 0.
        let turning = Fisheye { k1: -0.1, ..Fisheye::default() };
        assert!((turning.largest_angle_rad() - (1.0_f64 / 0.3).sqrt()).abs() < 1e-12);
    }
}
