//! Soft constraint of a landmark to the road plane, inside the bundle adjustment.

use motorcade_geometry::{Camera, Pose, World, robust::RobustKernel};
use nalgebra::{Matrix3, Point3, Vector3, Vector6};

use super::options::{BundleOptions, WindowOptions};

/// A point on the road as a keyframe sees it: residual `(mᵀ T X − 1) / sigma`, its height above the road in camera heights.
#[derive(Clone, Copy, Debug)]
pub struct RoadPoint {
    /// Index of the pose of the keyframe.
    pub pose: usize,
    /// The road in that camera's frame, `mᵀX = 1`.
    pub m: Vector3<f64>,
    /// Standard deviation of the height \[camera heights\].
    pub sigma: f64,
}

impl RoadPoint {
    /// The constraint of a point in the camera of pose `pose`; `None` when it does not belong to the road `m`.
    pub(crate) fn new(
        pose: usize,
        m: &Vector3<f64>,
        point_in_camera: &Point3<f64>,
        options: &WindowOptions,
    ) -> Option<Self> {
        let p = point_in_camera.coords * m.norm();
        let above = m.dot(&point_in_camera.coords) - 1.0;
        let belongs = above.abs() < options.road_gate_heights
            && p.x.abs() < options.road_half_width_heights
            && p.z < options.road_far_heights
            && p.z > options.road_near_heights;
        let sigma = options.road_unevenness_heights.hypot(options.plane_tilt_sigma_rad * p.z);
        belongs.then_some(Self { pose, m: *m, sigma })
    }

    /// Constraint of one of `count` points that share the plane and its error: together they carry the plane's information
    /// once.
    #[must_use]
    pub(crate) fn sharing_plane(self, count: usize, options: &WindowOptions) -> Self {
        Self { sigma: self.sigma.hypot(options.plane_height_sigma * (count as f64).sqrt()), ..self }
    }

    /// Cost \[px²\].
    pub(crate) fn cost(
        &self,
        pose: &Pose<Camera, World>,
        point: &Point3<f64>,
        options: &BundleOptions,
    ) -> f64 {
        let residual = (self.m.dot(&pose.transform_point(point).coords) - 1.0) / self.sigma;
        let kernel = RobustKernel::Cauchy(options.road_point_kernel);
        options.pixel_sigma_px * options.pixel_sigma_px * kernel.cost(residual * residual)
    }

    /// Residual, its weight \[px²\], and its Jacobians by the pose (1×6, right perturbation `[ω, ν]` of `camera_from_world`)
    /// and the point (1×3).
    pub(crate) fn linearise(
        &self,
        pose: &Pose<Camera, World>,
        point: &Point3<f64>,
        options: &BundleOptions,
    ) -> (f64, f64, Vector6<f64>, Vector3<f64>) {
        let residual = (self.m.dot(&pose.transform_point(point).coords) - 1.0) / self.sigma;
        // mᵀ T exp(δ) X: ∂/∂X = mᵀR, ∂/∂ω = −mᵀR X^, ∂/∂ν = mᵀR
        let rotation: Matrix3<f64> = pose.rotation_matrix();
        let by_point = rotation.tr_mul(&self.m) / self.sigma;
        let by_turn = point.coords.cross(&by_point);
        let by_pose = Vector6::new(by_turn.x, by_turn.y, by_turn.z, by_point.x, by_point.y, by_point.z);
        let kernel = RobustKernel::Cauchy(options.road_point_kernel);
        let weight = options.pixel_sigma_px * options.pixel_sigma_px * kernel.weight(residual * residual);
        (residual, weight, by_pose, by_point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::numeric::jacobian_error;
    use nalgebra::{DMatrix, DVector};
    use std::convert::Infallible;

    #[test]
    fn jacobians_match_differences() {
        let options = BundleOptions::default();
        let pose = Pose::<Camera, World>::exp(&Vector6::new(0.02, -0.05, 0.01, 0.3, -0.2, 1.0));
        let point = Point3::new(0.4, 1.8, 9.0);
        let road_point = RoadPoint { pose: 0, m: Vector3::new(0.02, 0.55, -0.01), sigma: 0.05 };
        let (_, _, by_pose, by_point) = road_point.linearise(&pose, &point, &options);
        let analytic = by_pose.iter().chain(&by_point).copied();
        let error = jacobian_error(&DMatrix::from_iterator(1, 9, analytic), |step| {
            let (turn, shift) = (step.fixed_rows::<6>(0).into_owned(), step.fixed_rows::<3>(6));
            let (residual, ..) = road_point.linearise(&pose.retract(&turn), &(point + shift), &options);
            Ok::<_, Infallible>(DVector::from_element(1, residual))
        });
        assert!(error.unwrap() < 1e-7);
    }

    #[test]
    fn only_points_of_the_own_lane_near_the_plane_belong_to_the_road() {
        let m = Vector3::new(0.0, 0.5, 0.0);
        let belongs = |x: f64, y: f64, z: f64| {
            RoadPoint::new(0, &m, &Point3::new(x, y, z), &WindowOptions::default()).is_some()
        };
        assert!(belongs(1.0, 2.05, 20.0) && belongs(-2.0, 1.9, 6.0));
        assert!(!belongs(1.0, 1.5, 20.0) && !belongs(4.0, 2.0, 10.0) && !belongs(0.0, 2.0, 40.0));
    }
}
