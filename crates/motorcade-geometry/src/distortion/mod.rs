//! Distortion of lenses, in normalised coordinates.

mod fisheye;
mod radial_tangential;
mod rational;

use std::f64::consts::FRAC_PI_2;

use crate::camera::InvalidCamera;
use crate::polynomial::bisect;

pub use fisheye::Fisheye;
pub use radial_tangential::RadialTangential;
pub use rational::Rational;

/// How a lens departs from a pinhole. The default is none: radial-tangential with coefficients 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// Brown–Conrady with five coefficients (OpenCV, ROS `plumb_bob`, Kalibr `radtan`).
    RadialTangential(RadialTangential),
    /// Brown–Conrady with a rational radial part, eight coefficients (OpenCV, ROS `rational_polynomial`).
    Rational(Rational),
    /// Kannala–Brandt with four coefficients (OpenCV `fisheye`, ROS and Kalibr `equidistant`, ORB-SLAM `KannalaBrandt8`).
    Fisheye(Fisheye),
}

/// Coefficients of long lenses are large; none is larger than this.
const LARGEST_COEFFICIENT: f64 = 1e6;
/// A fisheye polynomial that turns back before this angle is none \[rad\].
const SMALLEST_FISHEYE_RAD: f64 = 0.1;
/// Angle to which the radial part of models in tan θ is examined: tan² 89° \[-\].
const LARGEST_R2: f64 = 3282.0;

impl Default for Distortion {
    fn default() -> Self {
        Self::RadialTangential(RadialTangential::default())
    }
}

impl Distortion {
    /// True when nothing is distorted.
    pub fn is_none(&self) -> bool {
        match self {
            Self::RadialTangential(d) => *d == RadialTangential::default(),
            Self::Rational(d) => *d == Rational::default(),
            Self::Fisheye(_) => false,
        }
    }
    /// Name of the model, as calibrations in TOML state it.
    pub fn model(&self) -> &'static str {
        match self {
            Self::RadialTangential(_) => "radial-tangential",
            Self::Rational(_) => "rational",
            Self::Fisheye(_) => "fisheye",
        }
    }
    /// Coefficients with their names, in the order of OpenCV.
    pub fn coefficients(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::RadialTangential(d) => {
                vec![("k1", d.k1), ("k2", d.k2), ("p1", d.p1), ("p2", d.p2), ("k3", d.k3)]
            }
            Self::Rational(d) => vec![
                ("k1", d.k1),
                ("k2", d.k2),
                ("p1", d.p1),
                ("p2", d.p2),
                ("k3", d.k3),
                ("k4", d.k4),
                ("k5", d.k5),
                ("k6", d.k6),
            ],
            Self::Fisheye(d) => vec![("k1", d.k1), ("k2", d.k2), ("k3", d.k3), ("k4", d.k4)],
        }
    }
    /// Refuses coefficients no lens has, by name.
    ///
    /// # Errors
    /// A coefficient that is not finite or beyond 1e6, or a fisheye polynomial that turns back within 0.1 rad of the axis.
    pub fn validate(&self) -> Result<(), InvalidCamera> {
        for (name, value) in self.coefficients() {
            if value.is_nan() || value.abs() > LARGEST_COEFFICIENT {
                return Err(InvalidCamera(format!(
                    "{name} = {value:e} must be finite and at most {LARGEST_COEFFICIENT:e}"
                )));
            }
        }
        let largest = self.largest_angle_rad();
        if matches!(self, Self::Fisheye(_)) && largest < SMALLEST_FISHEYE_RAD {
            return Err(InvalidCamera(format!(
                "k1 .. k4: the fisheye polynomial turns back {:.2} degrees from the axis; are they of another model?",
                largest.to_degrees()
            )));
        }
        Ok(())
    }
    /// Distorted position of the ray (x, y, 1), in normalised coordinates. Beyond
    /// [`largest_angle_rad`](Self::largest_angle_rad) it is meaningless: the polynomials turn back towards the middle.
    #[inline]
    pub fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        match self {
            Self::RadialTangential(d) => d.distort(x, y),
            Self::Rational(d) => d.distort(x, y),
            Self::Fisheye(d) => d.distort(x, y),
        }
    }
    /// Angle from the optical axis up to which the radial part is monotone \[rad\]: at most π/2, for fisheye lenses π.
    pub fn largest_angle_rad(&self) -> f64 {
        match self {
            Self::RadialTangential(d) => d.largest_r2().map_or(FRAC_PI_2, |r2| r2.sqrt().atan()),
            Self::Rational(d) => d.largest_r2().map_or(FRAC_PI_2, |r2| r2.sqrt().atan()),
            Self::Fisheye(d) => d.largest_angle_rad(),
        }
    }
    /// Distance from the middle at which a ray at this angle from the axis \[rad\] is seen, in normalised coordinates,
    /// without the tangential part.
    pub fn radius(&self, angle_rad: f64) -> f64 {
        match self {
            Self::RadialTangential(d) => d.radius(angle_rad.tan()),
            Self::Rational(d) => d.radius(angle_rad.tan()),
            Self::Fisheye(d) => d.radius(angle_rad),
        }
    }
    /// The inverse of [`radius`](Self::radius) \[rad\]: the angle from the axis of the ray that is seen at this distance from the
    /// middle, [`largest_angle_rad`](Self::largest_angle_rad) where there is none.
    pub fn angle_rad(&self, radius: f64) -> f64 {
        let most = match self {
            Self::Fisheye(_) => self.largest_angle_rad(),
            _ => self.largest_angle_rad().min(LARGEST_R2.sqrt().atan()),
        };
        if radius <= 0.0 {
            return 0.0;
        }
        if self.radius(most) <= radius {
            return most;
        }
        bisect(|angle| self.radius(angle) - radius, 0.0, most)
    }
}
