//! Vehicles on a level road.

use motorcade_geometry::{Pose, Vehicle};
use nalgebra::{Matrix3, Vector3};

use crate::CAMERA_HEIGHT_M;

/// `to_from_vehicle` of a vehicle on a level road below a camera, x right and z ahead \[m\]; `To` is that camera or a world with
/// its axes. Heading 0 drives away from the camera, positive turns left \[rad\].
pub fn on_road<To>(x_m: f64, z_m: f64, heading_rad: f64) -> Pose<To, Vehicle> {
    let (sin, cos) = heading_rad.sin_cos();
    let (forward, up) = (Vector3::new(-sin, 0.0, cos), -Vector3::y());
    let axes = Matrix3::from_columns(&[forward, up.cross(&forward), up]);
    Pose::from_matrix(&axes, &Vector3::new(x_m, CAMERA_HEIGHT_M, z_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Camera;

    #[test]
    fn positive_headings_turn_left() {
        let pose = on_road::<Camera>(1.0, 20.0, 0.3);
        let forward = pose.transform_vector(&Vector3::x());
        assert!((forward - Vector3::new(-0.3_f64.sin(), 0.0, 0.3_f64.cos())).norm() < 1e-12);
        assert!((pose.transform_vector(&Vector3::z()) + Vector3::y()).norm() < 1e-12);
        assert_eq!(pose.translation(), Vector3::new(1.0, CAMERA_HEIGHT_M, 20.0));
    }
}
