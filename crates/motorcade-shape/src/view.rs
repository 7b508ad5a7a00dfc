//! Projection of a posed shape, with self-occlusion.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use nalgebra::{Point2, Point3, Vector3};

use crate::prior::ShapePrior;

/// Smallest cosine between the outward normal of a visible face and the direction to the camera: at grazing angles (below about
/// 5°) a face is not visible. No option: labels of rendered pictures, which networks learn from, and projections of estimates have to agree.
pub const VISIBLE_COSINE: f64 = 0.08;

/// One keypoint in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedKeypoint {
    /// Pixel, also beyond the image border \[px\]; `None` behind the camera.
    pub pixel: Option<Point2<f64>>,
    /// Distance along the camera's z axis \[m\].
    pub depth_m: f64,
    /// Largest cosine between the outward normals of the point's faces and the direction to the camera; 1 when the prior has
    /// no faces for it.
    pub facing: f64,
    /// True in front of the camera, inside the image and not occluded by the vehicle's own body.
    pub visible: bool,
}

/// Projects all keypoints of a shape. A point is self-occluded when none of its faces is turned to the camera, which is exact for
/// a convex body.
pub fn project(
    prior: &ShapePrior,
    coefficients: &[f64],
    camera_from_vehicle: &Pose<Camera, Vehicle>,
    camera: &PinholeCamera,
) -> Vec<ProjectedKeypoint> {
    let camera_in_vehicle = Point3::from(camera_from_vehicle.inverse().translation());
    prior
        .keypoints()
        .iter()
        .zip(prior.points(coefficients))
        .map(|(keypoint, point)| {
            let in_camera = camera_from_vehicle.transform_point(&point);
            let pixel = camera.project(&in_camera);
            let (facing, _) = facing(&keypoint.faces, &(camera_in_vehicle - point));
            let inside = pixel.is_some_and(|p| camera.contains(&p, 0.0));
            ProjectedKeypoint {
                pixel,
                depth_m: in_camera.z,
                facing,
                visible: inside && facing > VISIBLE_COSINE,
            }
        })
        .collect()
}

/// Largest cosine between `faces` and the direction to the camera, and its face.
pub(crate) fn facing(faces: &[Vector3<f64>], to_camera: &Vector3<f64>) -> (f64, Option<Vector3<f64>>) {
    let distance = to_camera.norm().max(1e-9);
    faces
        .iter()
        .map(|face| (face.dot(to_camera) / distance, Some(*face)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((1.0, None))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keypoint::Layout;
    use motorcade_testing::{CAMERA, on_road};

    fn visible(prior: &ShapePrior, pose: &Pose<Camera, Vehicle>) -> Vec<String> {
        let points = project(prior, &[], pose, &CAMERA);
        let names = prior.keypoints().iter().zip(points);
        names.filter(|(_, p)| p.visible).map(|(k, _)| k.name.clone()).collect()
    }

    #[test]
    fn from_behind_the_tail_shows_and_from_the_front_the_nose() {
        let prior = ShapePrior::of_family(Layout::Car14);
        let behind = visible(&prior, &on_road(0.0, 15.0, 0.0));
        assert!(behind.contains(&"tail light, left".into()) && behind.contains(&"tail light, right".into()));
        assert!(!behind.iter().any(|n| n.contains("headlight") || n.contains("wheel")), "{behind:?}");
        let front = visible(&prior, &on_road(0.0, 15.0, std::f64::consts::PI));
        assert!(front.contains(&"headlight, right".into()) && !front.iter().any(|n| n.contains("tail")));
    }

    #[test]
    fn the_side_that_faces_the_camera_shows() {
        // A car ahead on the right that drives away shows its left side.
        let prior = ShapePrior::of_family(Layout::Car36);
        let names = visible(&prior, &on_road(4.0, 12.0, 0.0));
        assert!(names.contains(&"rear wheel centre, left".into()), "{names:?}");
        assert!(!names.contains(&"rear wheel centre, right".into()));
        // Outside the image: projected, but not visible.
        let outside = project(&prior, &[], &on_road(16.0, 12.0, 0.0), &CAMERA);
        assert!(outside.iter().all(|p| p.pixel.is_some() && !p.visible));
    }
}
