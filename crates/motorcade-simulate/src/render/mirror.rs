//! A wet road as smooth as a mirror: the scene as seen by a camera mirrored at the road.

use image::GrayImage;
use motorcade_geometry::{Camera, PinholeCamera, Pose};
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::colour::{Colour, mixed, scaled};
use super::resolve::Rays;
use crate::site::Site;

/// Farthest road that the plane is fitted to \[m\].
const FAR_M: f32 = 20.0;
/// Brightness of wet asphalt, of dry one.
const WET: f32 = 0.6;
/// Reflection of water at normal incidence, and the share of the surface that is smooth.
const NORMAL: f64 = 0.02;
const SMOOTH: f64 = 0.85;

/// Plane of the road as a mirror: unit normal upwards and distance from the origin along it, in the site and not in a camera.
pub(super) struct MirrorPlane {
    normal: Vector3<f64>,
    offset: f64,
}

impl MirrorPlane {
    /// By least squares z = a + b x + c y over the near road pixels of a picture; `None` where none is seen.
    pub(super) fn of(
        camera: &PinholeCamera,
        pose: &Pose<Site, Camera>,
        depth_m: &[f32],
        road: &GrayImage,
    ) -> Option<Self> {
        let rays = Rays::of(camera, pose);
        let eye = Point3::from(pose.translation());
        let (mut h, mut g) = (Matrix3::zeros(), Vector3::zeros());
        for (pixel, depth_m) in road.enumerate_pixels().zip(depth_m) {
            let ((x, y, share), depth) = (pixel, *depth_m);
            if share.0[0] == 255 && depth < FAR_M {
                let point = rays.at(f64::from(x), f64::from(y)) * f64::from(depth);
                let row = Vector3::new(1.0, point.x, point.y);
                h += row * row.transpose();
                g += row * point.z;
            }
        }
        let [a, b, c]: [f64; 3] = (h.try_inverse()? * g).into();
        let normal = Vector3::new(-b, -c, 1.0).normalize();
        Some(Self { normal, offset: normal.dot(&(eye.coords + Vector3::new(0.0, 0.0, a))) })
    }

    /// The mirrored camera. Its picture is that of the mirror upside down: a reflection is no rotation, with the rows turned round it is.
    pub(super) fn mirrored(
        &self,
        camera: &PinholeCamera,
        pose: &Pose<Site, Camera>,
    ) -> (PinholeCamera, Pose<Site, Camera>) {
        let householder = Matrix3::identity() - 2.0 * self.normal * self.normal.transpose();
        let rows_turned = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
        let rotation = householder * pose.rotation_matrix() * rows_turned;
        let eye = pose.translation();
        let below = eye - self.normal * (2.0 * (self.normal.dot(&eye) - self.offset));
        let turned = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let cy = f64::from(camera.height) - 1.0 - camera.cy;
        (PinholeCamera { cy, ..*camera }, Pose::from_parts(turned, below))
    }

    /// Mixes the picture of the mirrored camera into the road of the picture, by Schlick's approximation.
    pub(super) fn reflect(
        &self,
        light: &mut [Colour],
        mirror: &[Colour],
        road: &GrayImage,
        camera: &PinholeCamera,
        pose: &Pose<Site, Camera>,
    ) {
        let rays = Rays::of(camera, pose);
        let width = camera.width as usize;
        for ((x, y, share), colour) in road.enumerate_pixels().zip(light) {
            let row = (camera.height - 1 - y) as usize;
            let Some(seen) = mirror.get(row * width + x as usize) else { continue };
            let facing = -rays.at(f64::from(x), f64::from(y)).normalize().dot(&self.normal);
            let fresnel = NORMAL + (1.0 - NORMAL) * (1.0 - facing.clamp(0.0, 1.0)).powi(5);
            let wet = mixed(scaled(*colour, WET), *seen, (SMOOTH * fresnel) as f32);
            *colour = mixed(*colour, wet, f32::from(share.0[0]) / 255.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;
    use nalgebra::Point2;

    /// A point above the road appears in the mirrored camera where its mirror image below the road appears in the camera.
    #[test]
    fn the_mirrored_camera_sees_points_where_their_images_are() {
        let axes = Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
        let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let turned = level * UnitQuaternion::from_euler_angles(0.03, 0.1, 0.02);
        let pose: Pose<Site, Camera> = Pose::from_parts(turned, Vector3::new(5.0, -1.0, 2.6));
        let normal = Vector3::new(0.02, -0.01, 1.0).normalize();
        let plane = MirrorPlane { normal, offset: 1.0 };
        let (below, mirrored) = plane.mirrored(&CAMERA, &pose);
        for point in [Point3::new(25.0, 1.0, 3.0), Point3::new(40.0, -6.0, 7.0)] {
            let image = point - normal * (2.0 * (normal.dot(&point.coords) - 1.0));
            let seen: Point2<f64> = CAMERA.project(&pose.inverse().transform_point(&image)).unwrap();
            let found = below.project(&mirrored.inverse().transform_point(&point)).unwrap();
            let upside_down = Point2::new(found.x, f64::from(CAMERA.height) - 1.0 - found.y);
            assert!((seen - upside_down).norm() < 1e-9, "{seen} {upside_down}");
        }
    }
}
