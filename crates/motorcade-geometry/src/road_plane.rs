//! The plane of the road under a camera.

use nalgebra::Vector3;

/// Axes shorter than this have no direction: the camera looks straight down.
const LEAST_AXIS: f64 = 1e-6;

/// The plane of the road under a camera: `upᵀX = −height` for its points X in the camera.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RoadPlane {
    /// Unit normal towards the camera, camera frame; (0, −1, 0) for a level road.
    pub up: Vector3<f64>,
    /// Height of the camera above it \[m\].
    pub height_m: f64,
}

impl RoadPlane {
    /// A road parallel to the camera's axes x and z.
    pub fn level(height_m: f64) -> Self {
        Self { up: -Vector3::y(), height_m }
    }

    /// Point of the plane below the camera, camera frame.
    pub fn foot(&self) -> Vector3<f64> {
        -self.up * self.height_m
    }

    /// Optical axis projected onto the plane, unit, camera frame; the axis itself for a camera that looks straight down.
    pub fn ahead(&self) -> Vector3<f64> {
        (Vector3::z() - self.up * self.up.z).try_normalize(LEAST_AXIS).unwrap_or_else(Vector3::z)
    }

    /// Left along the plane, unit, camera frame.
    pub fn left(&self) -> Vector3<f64> {
        self.up.cross(&self.ahead())
    }

    /// Right along the plane, unit, camera frame.
    pub fn right(&self) -> Vector3<f64> {
        self.ahead().cross(&self.up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_along_the_plane() {
        // Nose down by atan(1/2): the road rises in the camera.
        let road = RoadPlane { up: Vector3::new(0.0, -2.0, -1.0).normalize(), height_m: 2.0 };
        let (ahead, right) = (road.ahead(), road.right());
        assert!(ahead.dot(&road.up).abs() < 1e-12 && (right - Vector3::x()).norm() < 1e-12);
        assert_eq!(road.left(), -right);
        let point = road.foot() + 7.0 * ahead - 2.0 * right;
        assert!((point.dot(&road.up) + road.height_m).abs() < 1e-12);
        assert_eq!(RoadPlane::level(1.5).foot(), Vector3::new(0.0, 1.5, 0.0));
        assert_eq!(RoadPlane { up: -Vector3::z(), height_m: 1.0 }.ahead(), Vector3::z());
    }
}
