//! What one frame says about road and scale, and how it reads once the whole way is known.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::alignment::RoadPlane;
use super::profile::{Curvature, driven_curvature};
use crate::trajectory::OdometryTrajectory;

/// What one frame says about road and scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadMeasurement {
    /// Frame (row of the run).
    pub frame: usize,
    /// Earlier frame it was compared with.
    pub reference: usize,
    /// `[log(|m|·height unit), pitch, roll]`: log of 1 / camera height in the odometry's unit, pitch and roll of the road
    /// relative to the camera \[rad\].
    pub value: Vector3<f64>,
    /// Distance between the two cameras in the odometry's unit, as the poses stood then.
    pub baseline: f64,
    /// Covariance of the value (3×3) as the pixels tell it.
    pub covariance: Matrix3<f64>,
    /// The road's vertical curvature, where it was looked for.
    pub curvature: Option<RoadCurvature>,
    /// Share of the road pixels that agree.
    pub agreement: f64,
    /// Pixels used.
    pub pixels: usize,
}

/// What the pixels say of the road's vertical curvature, and what they could not keep apart from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadCurvature {
    /// Curvature times the camera's height, positive at the foot of a hill.
    pub value: f64,
    /// Its variance.
    pub variance: f64,
    /// Its covariance with the value of the measurement (3).
    pub shared: Vector3<f64>,
    /// Standard deviation, about zero, that was assumed when it was found.
    pub assumed_sigma: f64,
}

/// A measurement as the final poses read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// As [`RoadMeasurement::value`].
    pub value: Vector3<f64>,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
}

impl RoadMeasurement {
    pub(crate) fn new(frame: usize, reference: usize, baseline: f64, plane: &RoadPlane) -> Self {
        let (value, jacobian) = coordinates(&plane.m, plane.curvature);
        let covariance = jacobian * plane.covariance * jacobian.transpose();
        let curvature = RoadCurvature {
            value: value.w,
            variance: covariance[(3, 3)],
            shared: covariance.fixed_view::<3, 1>(0, 3).into_owned(),
            assumed_sigma: plane.assumed_curvature_sigma,
        };
        Self {
            frame,
            reference,
            value: value.xyz(),
            baseline,
            covariance: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            curvature: Some(curvature),
            agreement: plane.agreement,
            pixels: plane.pixels,
        }
    }

    /// The measurement by the poses as they stand now. The images told the baseline in camera heights: a later adjustment
    /// that stretches the baseline stretches the height with it. And the way the camera took tells how the road is curved,
    /// better than the pixels could.
    pub fn read_by(&self, odometry: &OdometryTrajectory) -> Reading {
        let pose = |k: usize| odometry.camera_from_world(k);
        let now = pose(self.reference).zip(pose(self.frame));
        let now = now.map(|(a, b)| (a * b.inverse()).translation().norm()).filter(|l| *l > 1e-9);
        let stretched = now.map_or(0.0, |length| (self.baseline / length).ln());
        let value = self.value + Vector3::new(stretched, 0.0, 0.0);
        let flat = Reading { value, covariance: self.covariance };
        let known = self.curvature.zip(driven_curvature(odometry, self.frame, &value));
        known.map_or(flat, |(curvature, driven)| curvature.correct(&flat, &driven))
    }
}

impl RoadCurvature {
    /// The reading with the curvature that was driven in place of the one assumed.
    fn correct(&self, reading: &Reading, driven: &Curvature) -> Reading {
        // What the way adds to what was assumed already, as a measurement of its own.
        let information = driven.sigma.powi(-2) - self.assumed_sigma.powi(-2);
        if information <= 0.0 {
            return *reading;
        }
        let (variance, mean) = (1.0 / information, driven.value * driven.sigma.powi(-2) / information);
        let gain = self.shared / (self.variance + variance);
        Reading {
            value: reading.value + gain * (mean - self.value),
            covariance: reading.covariance - gain * self.shared.transpose(),
        }
    }
}

/// Unit normal of the road towards the camera, in the camera frame, from pitch and roll.
///
/// Pitch turns the far road up (a camera looking down has positive pitch), roll tips it sideways:
/// `n ∝ −(tan roll, 1, tan pitch)`.
pub fn road_normal(pitch_rad: f64, roll_rad: f64) -> Vector3<f64> {
    -Vector3::new(roll_rad.tan(), 1.0, pitch_rad.tan()).normalize()
}

/// `[log|m|, pitch, roll, curvature · height]` of a plane m with curvature c and the derivative by both (4×4).
fn coordinates(m: &Vector3<f64>, curvature: f64) -> (Vector4<f64>, Matrix4<f64>) {
    let norm2 = m.norm_squared();
    // c = κ/(2d) and the camera's height d = 1/|m|.
    let curved = 2.0 * curvature / norm2;
    let value = Vector4::new(0.5 * norm2.ln(), (m.z / m.y).atan(), (m.x / m.y).atan(), curved);
    let (yz, yx) = (m.y * m.y + m.z * m.z, m.y * m.y + m.x * m.x);
    let by_norm = -2.0 * curved / norm2;
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

    #[test]
    fn coordinates_match_their_derivative_and_the_normal() {
        let (m, curvature) = (Vector3::new(0.01, 0.55, 0.02), 4e-4);
        let (value, jacobian) = coordinates(&m, curvature);
        for k in 0..4 {
            let (mut moved, mut bent) = (m, curvature);
            if k < 3 {
                moved[k] += 1e-7
            } else {
                bent += 1e-7
            }
            assert!(((coordinates(&moved, bent).0 - value) / 1e-7 - jacobian.column(k)).norm() < 1e-5);
        }
        assert!((road_normal(value.y, value.z) + m.normalize()).norm() < 1e-12);
    }

    #[test]
    fn a_known_curvature_takes_the_place_of_the_one_assumed() {
        // One number x and the curvature b, seen together as x + 2 b = 0.01 with a deviation of 0.001, b assumed 0 ± 0.001.
        let information = |sigma_b: f64| {
            let row = nalgebra::Vector2::new(1.0, 2.0) / 1e-3;
            row * row.transpose() + nalgebra::Matrix2::new(1e-6, 0.0, 0.0, sigma_b.powi(-2))
        };
        let right = nalgebra::Vector2::new(1.0, 2.0) * (0.01 / 1e-6);
        let solve = |mean: f64, sigma: f64| {
            let covariance = information(sigma).try_inverse().unwrap();
            (covariance * (right + nalgebra::Vector2::new(0.0, mean / (sigma * sigma))), covariance)
        };
        let (first, before) = solve(0.0, 1e-3);
        let curvature = RoadCurvature {
            value: first.y,
            variance: before[(1, 1)],
            shared: Vector3::new(before[(0, 1)], 0.0, 0.0),
            assumed_sigma: 1e-3,
        };
        let reading = Reading {
            value: Vector3::new(first.x, 0.0, 0.0),
            covariance: Matrix3::from_diagonal(&Vector3::new(before[(0, 0)], 1.0, 1.0)),
        };
        let corrected = curvature.correct(&reading, &Curvature { value: 4e-3, sigma: 2e-4 });
        let (second, after) = solve(4e-3, 2e-4);
        assert!((corrected.value.x - second.x).abs() < 1e-9);
        assert!((corrected.covariance[(0, 0)] - after[(0, 0)]).abs() < 1e-12);
        // A way that tells less than was assumed changes nothing.
        assert_eq!(curvature.correct(&reading, &Curvature { value: 4e-3, sigma: 2e-3 }), reading);
    }
}
