//! The estimate of one frame, as far as it is drawn.

use motorcade_geometry::{Camera, Pose, RoadPlane, Vehicle};
use nalgebra::{Point3, Vector3};

/// The estimate of one frame. Lengths in metres, all in the camera of this frame.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The input's own number of the frame.
    pub number: u64,
    /// Time \[s\].
    pub time_s: f64,
    /// Origin of the camera's pose in words, where it was not tracked.
    pub status: Option<String>,
    /// Speed of the camera \[m/s\].
    pub speed_mps: f64,
    /// Its standard deviation \[m/s\], where it is known.
    pub speed_sigma_mps: Option<f64>,
    /// The road.
    pub road: RoadPlane,
    /// Vehicles, in any order.
    pub vehicles: Vec<SceneVehicle>,
}

/// A vehicle of a frame.
#[derive(Clone, Debug)]
pub struct SceneVehicle {
    /// Identity.
    pub id: u64,
    /// Name of its class.
    pub class: String,
    /// Hue of its colour \[deg\].
    pub hue_deg: u32,
    /// Pose; the origin of the vehicle is on the road below the centre of the body.
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Length, width, height \[m\].
    pub size_m: [f64; 3],
    /// Standard deviations of the position relative to the camera, along the vehicle's forward and left axes \[m\].
    pub sigma_m: [f64; 2],
    /// Speed over the road, forward positive \[m/s\].
    pub speed_mps: f64,
    /// True when it moves during its track.
    pub moving: bool,
    /// True when it is drawn as moving and may stand, or as parked and may move.
    pub unsure: bool,
    /// True when it was not seen in this frame, or may be none.
    pub faint: bool,
    /// Ground-contact positions of the last seconds in the camera of this frame \[m\], oldest first.
    pub trail_in_camera: Vec<Point3<f64>>,
}

/// Coordinates ahead and to the right of a point, along the road \[m\].
pub(crate) fn ahead_and_right(road: &RoadPlane, point_in_camera: &Point3<f64>) -> [f64; 2] {
    [point_in_camera.coords.dot(&road.ahead()), point_in_camera.coords.dot(&road.right())]
}

impl SceneVehicle {
    /// Ground-contact position, camera frame \[m\].
    pub(crate) fn position(&self) -> Point3<f64> {
        Point3::from(self.camera_from_vehicle.translation())
    }

    /// Standard deviation of the position on the road \[m\].
    pub(crate) fn position_sigma_m(&self) -> f64 {
        self.sigma_m[0].hypot(self.sigma_m[1])
    }

    /// Standard deviation of the position along a unit direction in the camera \[m\].
    pub(crate) fn sigma_along_m(&self, direction: &Vector3<f64>) -> f64 {
        let axis = |axis: Vector3<f64>| self.camera_from_vehicle.transform_vector(&axis).dot(direction);
        (self.sigma_m[0] * axis(Vector3::x())).hypot(self.sigma_m[1] * axis(Vector3::y()))
    }

    /// True when all that is drawn is a finite number of a size that can be drawn.
    pub(crate) fn is_drawable(&self) -> bool {
        let fine = |v: &f64| v.is_finite() && v.abs() < 1e6;
        self.camera_from_vehicle.is_finite()
            && self.position().iter().all(fine)
            && self.size_m.iter().chain(&self.sigma_m).all(|v| fine(v) && *v >= 0.0)
            && self.size_m.iter().all(|v| *v > 0.0)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::Matrix3;

    /// A car of 4 × 1.8 × 1.6 m with its heading along the view, `right` and `ahead` of a camera 1.5 m above a level road \[m\].
    pub(crate) fn car(right: f64, ahead: f64) -> SceneVehicle {
        // Columns: forward, left and up of the vehicle in the camera.
        let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
        SceneVehicle {
            id: 3,
            class: "Car".into(),
            hue_deg: 20,
            camera_from_vehicle: Pose::from_matrix(&rotation, &Vector3::new(right, 1.5, ahead)),
            size_m: [4.0, 1.8, 1.6],
            sigma_m: [0.4, 0.2],
            speed_mps: 10.0,
            moving: true,
            unsure: false,
            faint: false,
            trail_in_camera: Vec::new(),
        }
    }

    #[test]
    fn coordinates_follow_the_road() {
        // Nose down by atan(1/2): the road rises in the camera.
        let road = RoadPlane { up: Vector3::new(0.0, -2.0, -1.0).normalize(), height_m: 2.0 };
        let point = Point3::from(road.foot() + 7.0 * road.ahead() - 2.0 * road.right());
        let [a, r] = ahead_and_right(&road, &point);
        assert!((a - 7.0).abs() < 1e-9 && (r + 2.0).abs() < 1e-9);
    }

    #[test]
    fn deviations_turn_with_the_direction() {
        let vehicle = car(0.0, 10.0);
        assert!((vehicle.sigma_along_m(&Vector3::z()) - 0.4).abs() < 1e-12);
        assert!((vehicle.sigma_along_m(&Vector3::x()) - 0.2).abs() < 1e-12);
        assert!(vehicle.is_drawable());
        assert!(!SceneVehicle { sigma_m: [f64::NAN, 0.1], ..car(0.0, 9.0) }.is_drawable());
    }
}
