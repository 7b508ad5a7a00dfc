//! Scale and tilt of the road by one frame, and their correction by the final trajectory.

use nalgebra::{Matrix3, Vector3};

use super::options::ProfileOptions;
use super::plane::{AlignedRoad, coordinates};
use super::profile::{Curvature, driven_curvature};
use super::state::RoadState;
use crate::trajectory::OdometryTrajectory;

/// Scale and tilt of the road by one frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RoadMeasurement {
    /// Frame (row of the run).
    pub frame: usize,
    /// Earlier frame it was compared with.
    pub reference: usize,
    /// Height of the camera and tilt of the road.
    pub state: RoadState,
    /// Distance between the two cameras in the odometry's unit, by the poses at that time.
    pub baseline: f64,
    /// Covariance of the state (3×3) from the pixels.
    pub covariance: Matrix3<f64>,
    /// The road's vertical curvature, where it was estimated.
    pub curvature: Option<RoadCurvature>,
    /// Share of the road pixels that agree.
    pub agreement: f64,
    /// Pixels used.
    pub pixels: usize,
}

/// The road's vertical curvature by the pixels, and its correlation with the measurement.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RoadCurvature {
    /// Curvature times the camera's height, positive at the foot of a hill.
    pub value: f64,
    /// Its variance.
    pub variance: f64,
    /// Its covariance with the state of the measurement (3×1).
    pub cross_covariance: Vector3<f64>,
    /// Standard deviation of its prior about zero.
    pub prior_sigma: f64,
}

/// Measurements to be forgotten at least before memory is moved.
const LEAST_FORGOTTEN: usize = 256;

/// Takes out the measurements of frames before `frame`, but for the newest, once they are worth the work.
pub(super) fn forget_before(measurements: &mut Vec<RoadMeasurement>, frame: usize) -> Vec<RoadMeasurement> {
    let old = measurements.partition_point(|m| m.frame < frame).min(measurements.len().saturating_sub(1));
    let old = if old < LEAST_FORGOTTEN { 0 } else { old };
    measurements.drain(..old).collect()
}

/// A measurement corrected by the poses of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadEstimate {
    /// Height of the camera and tilt of the road.
    pub state: RoadState,
    /// Covariance (3×3).
    pub covariance: Matrix3<f64>,
}

impl RoadMeasurement {
    pub(crate) fn new(frame: usize, reference: usize, baseline: f64, plane: &AlignedRoad) -> Self {
        let (value, jacobian) = coordinates(&plane.m, plane.curvature);
        let covariance = jacobian * plane.covariance * jacobian.transpose();
        let curvature = RoadCurvature {
            value: value.w,
            variance: covariance[(3, 3)],
            cross_covariance: covariance.fixed_view::<3, 1>(0, 3).into_owned(),
            prior_sigma: plane.prior_curvature_sigma,
        };
        Self {
            frame,
            reference,
            state: RoadState::from_vector(&value.xyz()),
            baseline,
            covariance: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            curvature: Some(curvature),
            agreement: plane.agreement,
            pixels: plane.pixels,
        }
    }

    /// The measurement by the present poses of the trajectory: the images measured the baseline in camera heights, so a later
    /// adjustment of the baseline scales the height with it; and the driven trajectory measures the road's curvature better
    /// than the pixels.
    pub fn corrected(&self, trajectory: &OdometryTrajectory, options: &ProfileOptions) -> RoadEstimate {
        let pose = |k: usize| trajectory.camera_from_world(k);
        let now = pose(self.reference).zip(pose(self.frame));
        let now = now.map(|(a, b)| (a * b.inverse()).translation().norm()).filter(|l| *l > 1e-9);
        let stretched = now.map_or(0.0, |length| (self.baseline / length).ln());
        let log_inverse_height = self.state.log_inverse_height + stretched;
        let state = RoadState { log_inverse_height, ..self.state };
        let estimate = RoadEstimate { state, covariance: self.covariance };
        let known = self.curvature.zip(driven_curvature(trajectory, self.frame, &state, options));
        known.map_or(estimate, |(curvature, driven)| curvature.correct(&estimate, &driven))
    }
}

impl RoadCurvature {
    /// The estimate with the driven curvature in place of the prior.
    fn correct(&self, estimate: &RoadEstimate, driven: &Curvature) -> RoadEstimate {
        // Information of the trajectory beyond the prior, as an independent measurement.
        let information = driven.sigma.powi(-2) - self.prior_sigma.powi(-2);
        if information <= 0.0 {
            return *estimate;
        }
        let (variance, mean) = (1.0 / information, driven.value * driven.sigma.powi(-2) / information);
        let gain = self.cross_covariance / (self.variance + variance);
        let state = estimate.state.to_vector() + gain * (mean - self.value);
        RoadEstimate {
            state: RoadState::from_vector(&state),
            covariance: estimate.covariance - gain * self.cross_covariance.transpose(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driven_curvature_replaces_the_prior() {
        // One number x and the curvature b, measured as x + 2 b = 0.01 with a deviation of 0.001; prior of b: 0 ± 0.001.
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
            cross_covariance: Vector3::new(before[(0, 1)], 0.0, 0.0),
            prior_sigma: 1e-3,
        };
        let estimate = RoadEstimate {
            state: RoadState { log_inverse_height: first.x, pitch_rad: 0.0, roll_rad: 0.0 },
            covariance: Matrix3::from_diagonal(&Vector3::new(before[(0, 0)], 1.0, 1.0)),
        };
        let corrected = curvature.correct(&estimate, &Curvature { value: 4e-3, sigma: 2e-4 });
        let (second, after) = solve(4e-3, 2e-4);
        assert!((corrected.state.log_inverse_height - second.x).abs() < 1e-9);
        assert!((corrected.covariance[(0, 0)] - after[(0, 0)]).abs() < 1e-12);
        // A trajectory less informative than the prior changes nothing.
        assert_eq!(curvature.correct(&estimate, &Curvature { value: 4e-3, sigma: 2e-3 }), estimate);
    }
}
