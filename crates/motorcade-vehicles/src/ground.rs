//! Camera pose and road plane of one frame, and the road-aligned axes.

use motorcade_geometry::{Camera, Pose, RoadPlane, World};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::road_ahead::RoadAhead;

/// Camera pose and road of one frame.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct GroundFrame {
    /// Camera \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Unit normal of the road towards the camera, camera frame.
    pub up: Vector3<f64>,
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// Standard deviation of the road's pitch as seen from this camera \[rad\].
    pub pitch_sigma_rad: f64,
    /// Standard deviation of the change of the road's slope over [`road_slope_length_m`](crate::BoxFitOptions::road_slope_length_m), as far as it exceeds
    /// that of streets: hills. Zero where none were driven over \[rad\].
    #[serde(default)]
    pub slope_change_sigma_rad: f64,
    /// Height of the road ahead over the plane; `None` before [`measure_road_ahead`](crate::measure_road_ahead): a road as level as streets are.
    #[serde(default)]
    pub road_ahead: Option<RoadAhead>,
    /// Time \[s\].
    pub time_s: f64,
}

impl GroundFrame {
    /// The road under the camera.
    pub fn road(&self) -> RoadPlane {
        RoadPlane { up: self.up, height_m: self.height_m }
    }

    /// Point of the road plane below the camera, camera frame.
    pub fn foot(&self) -> Vector3<f64> {
        self.road().foot()
    }

    /// Optical axis projected onto the road plane, unit, camera frame.
    pub fn ahead(&self) -> Vector3<f64> {
        self.road().ahead()
    }

    /// Left in the road plane, unit, camera frame.
    pub fn left(&self) -> Vector3<f64> {
        self.road().left()
    }

    /// Point `ahead_m` in front of and `left_m` to the left of the foot, `above_m` over the plane; camera frame.
    pub fn point(&self, ahead_m: f64, left_m: f64, above_m: f64) -> Point3<f64> {
        Point3::from(self.foot() + self.ahead() * ahead_m + self.left() * left_m + self.up * above_m)
    }

    /// The frame without what the way ahead tells: a road that is the plane, and as uncertain as if nobody had driven on.
    pub(crate) fn without_road_ahead(self) -> Self {
        Self { road_ahead: None, ..self }
    }

    /// Height of the road over the plane at a distance ahead \[m\], and its change with the distance.
    pub fn rise(&self, ahead_m: f64) -> (f64, f64) {
        self.road_ahead.map_or((0.0, 0.0), |road| road.rise(ahead_m))
    }

    /// Heading of a direction given in the camera frame: angle from straight ahead, to the left positive \[rad\].
    pub fn heading_of(&self, direction: &Vector3<f64>) -> f64 {
        direction.dot(&self.left()).atan2(direction.dot(&self.ahead()))
    }

    /// Unit direction of a heading, camera frame.
    pub fn direction_of(&self, heading_rad: f64) -> Vector3<f64> {
        self.ahead() * heading_rad.cos() + self.left() * heading_rad.sin()
    }

    /// Columns ahead, left, up: rotation from the road-aligned axes into the camera frame (3×3).
    pub(crate) fn axes(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&[self.ahead(), self.left(), self.up])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_and_headings_round_trip() {
        let up = Vector3::new(0.01, -1.0, 0.02).normalize();
        let ground = GroundFrame {
            world_from_camera: Pose::identity(),
            up,
            height_m: 1.6,
            pitch_sigma_rad: 0.0,
            slope_change_sigma_rad: 0.0,
            road_ahead: None,
            time_s: 0.0,
        };
        assert!(ground.left().x < -0.99);
        assert!(ground.ahead().z > 0.99);
        let p = ground.point(10.0, 2.0, 0.0);
        assert!((p.coords.dot(&up) + 1.6).abs() < 1e-12);
        let heading = 0.7;
        assert!((ground.heading_of(&ground.direction_of(heading)) - heading).abs() < 1e-12);
    }
}
