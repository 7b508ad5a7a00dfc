//! Triangulation of the landmarks of a window.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, triangulate_rays};
use nalgebra::{Point2, Point3, Vector3};

use super::landmark::Landmark;
use super::window::Window;
use crate::rolling_shutter::RowMotion;

/// `camera_from_world` and pixel \[px\].
type View = (Pose<Camera, World>, Point2<f64>);
/// Origin and unit direction in the world.
type Ray = (Point3<f64>, Vector3<f64>);

fn ray((camera_from_world, pixel): &View, camera: &PinholeCamera) -> Ray {
    let world_from_camera = camera_from_world.inverse();
    let direction = world_from_camera.transform_vector(&camera.ray(pixel)).normalize();
    (Point3::from(world_from_camera.translation()), direction)
}

impl Window {
    /// Triangulates landmarks whose observations have enough parallax.
    pub fn triangulate(&mut self, camera: &PinholeCamera) {
        let mut landmarks = std::mem::take(&mut self.landmarks);
        // Landmarks on moving vehicles are not part of the adjustment and are triangulated every time.
        let wanting = |l: &&mut Landmark| l.point_in_world.is_none() || !l.is_static();
        for landmark in landmarks.iter_mut().filter(wanting).filter(|l| l.observations.len() >= 2) {
            landmark.point_in_world = self.position(&landmark.observations, camera);
        }
        self.landmarks = landmarks;
    }

    /// Triangulates landmarks from a keyframe and the current frame at `camera_from_world`: they locate the next frame before
    /// the next keyframe exists. `row_motion` is that of the current frame.
    pub fn triangulate_tracked(
        &mut self,
        camera: &PinholeCamera,
        camera_from_world: &Pose<Camera, World>,
        row_motion: &RowMotion,
    ) {
        let mut landmarks = std::mem::take(&mut self.landmarks);
        for landmark in landmarks.iter_mut().filter(|l| l.point_in_world.is_none()) {
            let (Some(pixel), Some((number, first))) = (landmark.pixel, landmark.observations.first()) else {
                continue;
            };
            let Some(keyframe) = self.index_of(*number).and_then(|i| self.keyframes.get(i)) else { continue };
            let then = keyframe.row_motion.pose_of_row(&keyframe.camera_from_world, first.y);
            let views = [(then, *first), (row_motion.pose_of_row(camera_from_world, pixel.y), pixel)];
            landmark.point_in_world = self.position_from(&views, &views.map(|v| ray(&v, camera)), camera);
        }
        self.landmarks = landmarks;
    }

    fn position(&self, observations: &[(usize, Point2<f64>)], camera: &PinholeCamera) -> Option<Point3<f64>> {
        let view = |(n, p): &(usize, Point2<f64>)| {
            let keyframe = &self.keyframes[self.index_of(*n)?];
            Some((keyframe.row_motion.pose_of_row(&keyframe.camera_from_world, p.y), *p))
        };
        let views: Vec<View> = observations.iter().filter_map(view).collect();
        let rays: Vec<_> = views.iter().map(|v| ray(v, camera)).collect();
        self.position_from(&views, &rays, camera)
    }

    /// The point nearest to the rays of the views, if it agrees with all of them.
    fn position_from(&self, views: &[View], rays: &[Ray], camera: &PinholeCamera) -> Option<Point3<f64>> {
        let (first, last) = (rays.first()?, rays.last()?);
        if first.1.angle(&last.1) < self.options.least_parallax_rad {
            return None;
        }
        let point = triangulate_rays(rays)?;
        let agrees = |(camera_from_world, pixel): &View| {
            let projected = camera.project(&camera_from_world.transform_point(&point));
            projected.is_some_and(|p| (p - pixel).norm() < self.options.outlier_px)
        };
        views.iter().all(agrees).then_some(point)
    }
}
