//! The road plane's say in the bundle adjustment: points of the own lane lie on it, softly.

use motorcade_geometry::{Camera, Pose, World, robust::Kernel};
use nalgebra::{Matrix3, Point3, Vector3, Vector6};

use super::bundle::PIXEL_SIGMA_PX;

/// A point that lies on the road as a keyframe saw it: residual `(mᵀ T X − 1) / sigma`, its height above the road in camera
/// heights.
#[derive(Clone, Copy, Debug)]
pub struct OnRoad {
    /// Index of the pose of the keyframe.
    pub pose: usize,
    /// The road in that camera's frame, `mᵀX = 1`.
    pub m: Vector3<f64>,
    /// Standard deviation of the height \[camera heights\].
    pub sigma: f64,
}

/// Points further off than twice the standard deviation lose weight: they are something that lies on the road.
const KERNEL: Kernel = Kernel::Cauchy(2.0);
/// Half width of the stretch whose points count \[camera heights\]: the own lane, without its kerbs.
const HALF_WIDTH_HEIGHTS: f64 = 1.2;
/// Its far end \[camera heights\].
const FAR_HEIGHTS: f64 = 15.0;
/// Height above or below the road up to which a point may belong to it \[camera heights\]: 20 cm for a car.
const NEAR_HEIGHTS: f64 = 0.12;
/// Unevenness of the road \[camera heights\]: 3 cm for a car.
const UNEVEN_HEIGHTS: f64 = 0.02;
/// Standard deviation of the plane as aligned in one frame: of the camera's height over it (the body heaves) and of its tilt
/// \[rad\], 0.3°.
const HEIGHT: f64 = 0.02;
const TILT_RAD: f64 = 0.005;

impl OnRoad {
    /// Whether a point in the camera of pose `pose` belongs to the road `m`, and how strictly.
    pub fn of(pose: usize, m: &Vector3<f64>, in_camera: &Point3<f64>) -> Option<Self> {
        let p = in_camera.coords * m.norm();
        let above = m.dot(&in_camera.coords) - 1.0;
        let here = above.abs() < NEAR_HEIGHTS && p.x.abs() < HALF_WIDTH_HEIGHTS && p.z < FAR_HEIGHTS;
        (here && p.z > 1.0).then(|| Self { pose, m: *m, sigma: UNEVEN_HEIGHTS.hypot(TILT_RAD * p.z) })
    }

    /// The same when `count` points share the plane, and its error: together they say no more than it does.
    #[must_use]
    pub fn shared_by(self, count: usize) -> Self {
        Self { sigma: self.sigma.hypot(HEIGHT * (count as f64).sqrt()), ..self }
    }

    /// Cost \[px²\].
    pub(crate) fn cost(&self, pose: &Pose<Camera, World>, point: &Point3<f64>) -> f64 {
        let residual = (self.m.dot(&pose.transform_point(point).coords) - 1.0) / self.sigma;
        PIXEL_SIGMA_PX * PIXEL_SIGMA_PX * KERNEL.cost(residual * residual)
    }

    /// Residual, its weight \[px²\], and its Jacobians by the pose (1×6, right perturbation `[ω, ν]` of `camera_from_world`)
    /// and the point (1×3).
    pub(crate) fn linearise(
        &self,
        pose: &Pose<Camera, World>,
        point: &Point3<f64>,
    ) -> (f64, f64, Vector6<f64>, Vector3<f64>) {
        let residual = (self.m.dot(&pose.transform_point(point).coords) - 1.0) / self.sigma;
        // mᵀ T exp(δ) X: ∂/∂X = mᵀR, ∂/∂ω = −mᵀR X^, ∂/∂ν = mᵀR
        let rotation: Matrix3<f64> = pose.rotation_matrix();
        let by_point = rotation.tr_mul(&self.m) / self.sigma;
        let turn = point.coords.cross(&by_point);
        let by_pose = Vector6::new(turn.x, turn.y, turn.z, by_point.x, by_point.y, by_point.z);
        let weight = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX * KERNEL.weight(residual * residual);
        (residual, weight, by_pose, by_point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobians_match_differences() {
        let pose = Pose::<Camera, World>::exp(&Vector6::new(0.02, -0.05, 0.01, 0.3, -0.2, 1.0));
        let point = Point3::new(0.4, 1.8, 9.0);
        let on_road = OnRoad { pose: 0, m: Vector3::new(0.02, 0.55, -0.01), sigma: 0.05 };
        let residual = |pose: &Pose<Camera, World>, point: &Point3<f64>| on_road.linearise(pose, point).0;
        let (here, _, by_pose, by_point) = on_road.linearise(&pose, &point);
        for k in 0..6 {
            let mut step = Vector6::zeros();
            step[k] = 1e-7;
            let slope = (residual(&pose.retract(&step), &point) - here) / 1e-7;
            assert!((slope - by_pose[k]).abs() < 1e-4, "{k}: {slope} {}", by_pose[k]);
        }
        for k in 0..3 {
            let mut moved = point;
            moved[k] += 1e-7;
            assert!(((residual(&pose, &moved) - here) / 1e-7 - by_point[k]).abs() < 1e-4);
        }
    }

    #[test]
    fn only_the_own_lane_near_the_plane_belongs() {
        let m = Vector3::new(0.0, 0.5, 0.0);
        let belongs = |x: f64, y: f64, z: f64| OnRoad::of(0, &m, &Point3::new(x, y, z)).is_some();
        assert!(belongs(1.0, 2.05, 20.0) && belongs(-2.0, 1.9, 6.0));
        assert!(!belongs(1.0, 1.5, 20.0) && !belongs(4.0, 2.0, 10.0) && !belongs(0.0, 2.0, 40.0));
    }
}
