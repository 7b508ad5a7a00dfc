//! Rows of a rolling shutter: each is read a little later than the one above it.
//!
//! The time of a frame is that of its middle row. With the twist ξ of the camera's motion over one row, the pose of row v is
//! `exp((v − v_middle) ξ) T`, T that of the frame: interpolation at constant velocity, as in Hedborg et al., *Rolling shutter bundle
//! adjustment*, CVPR 2012, with the velocity known from the frames before.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::{Point2, Point3, Vector6};

use crate::time::seconds;

/// Motion of the camera from row to row; zero for a global shutter.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct RowMotion {
    /// Twist `[ω, ν]` over one row, in the camera (rad, odometry units).
    twist: Vector6<f64>,
    /// Row whose time is that of the frame \[px\].
    middle: f64,
}

impl RowMotion {
    /// All rows at once.
    pub fn none() -> Self {
        Self { twist: Vector6::zeros(), middle: 0.0 }
    }

    /// From the motion over the time in which all rows of a camera are read.
    pub fn new(readout: &Vector6<f64>, camera: &PinholeCamera) -> Self {
        let rows = f64::from(camera.height);
        Self { twist: readout / rows, middle: 0.5 * (rows - 1.0) }
    }

    /// `camera_from_world` at the time of a row \[px\], for that of the frame.
    pub fn pose_of_row(&self, camera_from_world: &Pose<Camera, World>, row: f64) -> Pose<Camera, World> {
        if self.is_none() {
            return *camera_from_world;
        }
        Pose::<Camera, Camera>::exp(&(self.twist * (row - self.middle))) * *camera_from_world
    }

    /// The pixel in which a point would have been seen at the time of the frame, instead of that of its row.
    pub fn at_frame_time(
        &self,
        camera: &PinholeCamera,
        camera_from_world: &Pose<Camera, World>,
        point_in_world: &Point3<f64>,
        pixel: &Point2<f64>,
    ) -> Point2<f64> {
        if self.is_none() {
            return *pixel;
        }
        let project = |pose: &Pose<Camera, World>| camera.project(&pose.transform_point(point_in_world));
        let moved = project(&self.pose_of_row(camera_from_world, pixel.y)).zip(project(camera_from_world));
        moved.map_or(*pixel, |(then, now)| pixel + (now - then))
    }

    fn is_none(&self) -> bool {
        self.twist == Vector6::zeros()
    }
}

/// Time by which a row is read later than the one above it, over the time between two frames.
pub(crate) fn row_share(readout_s: f64, camera: &PinholeCamera, between_ns: i64) -> f64 {
    if between_ns <= 0 { 0.0 } else { readout_s / f64::from(camera.height) / seconds(between_ns) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;

    #[test]
    fn a_point_is_put_where_the_frame_would_have_seen_it() {
        let pose: Pose<Camera, World> = Pose::exp(&Vector6::new(0.01, -0.03, 0.0, 0.1, 0.0, -1.2));
        let motion = RowMotion::new(&Vector6::new(0.0, 0.01, 0.0, 0.0, 0.0, -0.4), &CAMERA);
        let point = Point3::new(3.0, 1.4, 9.0);
        // The row in which it is seen, by iteration.
        let mut seen = CAMERA.project(&pose.transform_point(&point)).unwrap();
        let still = seen;
        for _ in 0..20 {
            seen = CAMERA.project(&motion.pose_of_row(&pose, seen.y).transform_point(&point)).unwrap();
        }
        assert!((seen - still).norm() > 2.0, "{seen} {still}");
        let corrected = motion.at_frame_time(&CAMERA, &pose, &point, &seen);
        assert!((corrected - still).norm() < 1e-6, "{corrected} {still}");
        assert_eq!(RowMotion::none().at_frame_time(&CAMERA, &pose, &point, &seen), seen);
    }
}
