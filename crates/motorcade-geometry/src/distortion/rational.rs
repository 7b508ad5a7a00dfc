//! Brown–Conrady distortion with a rational radial part.

use super::LARGEST_R2;
use crate::polynomial::{first_positive_root, product, value};

/// Brown–Conrady distortion with a rational radial part, OpenCV's first eight coefficients (`CALIB_RATIONAL_MODEL`; Claus and
/// Fitzgibbon, CVPR 2005, for rational models). With r² = x² + y² and
/// f = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶):
///
/// x' = x f + 2 p1 x y + p2 (r² + 2 x²)
/// y' = y f + p1 (r² + 2 y²) + 2 p2 x y
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rational {
    /// Radial r², numerator.
    pub k1: f64,
    /// Radial r⁴, numerator.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial r⁶, numerator.
    pub k3: f64,
    /// Radial r², denominator.
    pub k4: f64,
    /// Radial r⁴, denominator.
    pub k5: f64,
    /// Radial r⁶, denominator.
    pub k6: f64,
}

impl Rational {
    /// Distorted position of the ray (x, y, 1), in normalised coordinates.
    #[inline]
    pub fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        let radial = self.factor(r2);
        let dx = 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x);
        let dy = self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y;
        (x * radial + dx, y * radial + dy)
    }
    /// Radial part at a distance r from the middle.
    pub(super) fn radius(&self, r: f64) -> f64 {
        r * self.factor(r * r)
    }
    /// r² up to which the radial part grows and has no pole; `None` when that is everywhere.
    pub(super) fn largest_r2(&self) -> Option<f64> {
        // d/dr (r N/D) = ((N + 2 s N') D − 2 s N D') / D² with s = r² and ' = d/ds.
        let (n, d) = (self.numerator(), self.denominator());
        let weighted = |p: [f64; 4], first: f64| {
            let mut power = first;
            p.map(|c| {
                let term = power * c;
                power += 2.0;
                term
            })
        };
        let growth = product(&weighted(n, 1.0), &d);
        let loss = product(&n, &weighted(d, 0.0));
        let slope: Vec<f64> = growth.iter().zip(&loss).map(|(a, b)| a - b).collect();
        let ends = [first_positive_root(&slope, LARGEST_R2), first_positive_root(&d, LARGEST_R2)];
        ends.into_iter().flatten().min_by(f64::total_cmp)
    }
    #[inline]
    fn factor(&self, r2: f64) -> f64 {
        value(&self.numerator(), r2) / value(&self.denominator(), r2)
    }
    fn numerator(&self) -> [f64; 4] {
        [1.0, self.k1, self.k2, self.k3]
    }
    fn denominator(&self) -> [f64; 4] {
        [1.0, self.k4, self.k5, self.k6]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_denominator_it_is_the_polynomial() {
        let (k1, k2, k3) = (-0.37, 0.2, -0.07);
        let rational = Rational { k1, k2, k3, p1: 0.002, p2: 0.001, ..Rational::default() };
        let plain = super::super::RadialTangential { k1, k2, k3, p1: 0.002, p2: 0.001 };
        let (a, b) = (rational.distort(0.7, -0.4), plain.distort(0.7, -0.4));
        assert!((a.0 - b.0).abs() < 1e-15 && (a.1 - b.1).abs() < 1e-15, "{a:?} {b:?}");
        let (a, b) = (rational.largest_r2().unwrap(), plain.largest_r2().unwrap());
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }

    #[test]
    fn a_pole_and_a_turn_end_the_picture() {
        // Pole at r² = 2.
        let pole = Rational { k4: -0.5, ..Rational::default() };
        assert!((pole.largest_r2().unwrap() - 2.0).abs() < 1e-12);
        // r / (1 + r²) turns at r = 1.
        let turn = Rational { k4: 1.0, ..Rational::default() };
        assert!((turn.largest_r2().unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(Rational::default().largest_r2(), None);
    }
}
