//! Pinhole cameras. Pixel centres lie at integer coordinates.

use nalgebra::{Matrix3, Point2, Point3, Vector3};

/// An undistorted pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinholeCamera {
    /// Focal length along x \[px\].
    pub fx: f64,
    /// Focal length along y \[px\].
    pub fy: f64,
    /// Principal point x \[px\].
    pub cx: f64,
    /// Principal point y \[px\].
    pub cy: f64,
    /// Image width \[px\].
    pub width: u32,
    /// Image height \[px\].
    pub height: u32,
}

/// Why intrinsics were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[error("camera intrinsics: {0}")]
pub struct InvalidCamera(pub(crate) String);

/// Longest side of an image \[px\].
const LARGEST_SIDE_PX: u32 = 32_768;

fn field_of_view_rad(focal_px: f64, side_px: u32) -> f64 {
    2.0 * (0.5 * f64::from(side_px) / focal_px).atan()
}

impl PinholeCamera {
    /// Refuses numbers no lens has: the principal point must lie inside the image of at most 32768 pixels a side, the field of
    /// view between 0.01° and 170°.
    pub fn validate(&self) -> Result<(), InvalidCamera> {
        let refuse = |text: String| Err(InvalidCamera(text));
        if !(self.fx.is_finite() && self.fx > 0.0 && self.fy.is_finite() && self.fy > 0.0) {
            return refuse(format!("focal lengths must be positive, got fx {} fy {}", self.fx, self.fy));
        }
        if self.width == 0 || self.height == 0 {
            return refuse(format!("image size {}x{} is empty", self.width, self.height));
        }
        if self.width.max(self.height) > LARGEST_SIDE_PX {
            let size = (self.width, self.height);
            return refuse(format!(
                "image size {}x{} is more than {LARGEST_SIDE_PX} px a side",
                size.0, size.1
            ));
        }
        for (name, focal, side) in [("fx", self.fx, self.width), ("fy", self.fy, self.height)] {
            let view_deg = field_of_view_rad(focal, side).to_degrees();
            if !(0.01..=170.0).contains(&view_deg) {
                return refuse(format!(
                    "{name} = {focal:e} px is a field of view of {view_deg:.3} degrees over {side} px; no pinhole camera has it"
                ));
            }
        }
        let inside = |c: f64, size: u32| c.is_finite() && c > 0.0 && c < f64::from(size);
        if !(inside(self.cx, self.width) && inside(self.cy, self.height)) {
            return refuse(format!(
                "principal point ({}, {}) lies outside the {}x{} image",
                self.cx, self.cy, self.width, self.height
            ));
        }
        Ok(())
    }
    /// Horizontal and vertical field of view \[rad\].
    pub fn field_of_view_rad(&self) -> (f64, f64) {
        (field_of_view_rad(self.fx, self.width), field_of_view_rad(self.fy, self.height))
    }
    /// K (3×3) \[px\].
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }
    /// K⁻¹ (3×3).
    pub fn inverse_matrix(&self) -> Matrix3<f64> {
        let (ix, iy) = (1.0 / self.fx, 1.0 / self.fy);
        Matrix3::new(ix, 0.0, -self.cx * ix, 0.0, iy, -self.cy * iy, 0.0, 0.0, 1.0)
    }
    /// The viewing ray through a pixel, with z = 1.
    #[inline]
    pub fn ray(&self, pixel: &Point2<f64>) -> Vector3<f64> {
        Vector3::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy, 1.0)
    }
    /// Projects a point in the camera frame; `None` behind the camera.
    #[inline]
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        // One millimetre: closer points have no meaningful image.
        (point_in_camera.z > 1e-3).then(|| {
            let iz = 1.0 / point_in_camera.z;
            Point2::new(
                self.fx * point_in_camera.x * iz + self.cx,
                self.fy * point_in_camera.y * iz + self.cy,
            )
        })
    }
    /// True when the pixel lies at least `margin_px` inside the image.
    pub fn contains(&self, pixel: &Point2<f64>, margin_px: f64) -> bool {
        pixel.x >= margin_px
            && pixel.y >= margin_px
            && pixel.x <= f64::from(self.width) - 1.0 - margin_px
            && pixel.y <= f64::from(self.height) - 1.0 - margin_px
    }
    /// Mean focal length \[px\].
    pub fn focal_px(&self) -> f64 {
        0.5 * (self.fx + self.fy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> PinholeCamera {
        PinholeCamera { fx: 720.0, fy: 715.0, cx: 610.0, cy: 173.0, width: 1242, height: 375 }
    }

    #[test]
    fn ray_and_project_are_inverse() {
        let pixel = Point2::new(17.5, 333.25);
        let point = Point3::from(camera().ray(&pixel) * 12.0);
        assert!((camera().project(&point).unwrap() - pixel).norm() < 1e-12);
        assert!(camera().project(&Point3::new(0.0, 0.0, -1.0)).is_none());
    }

    #[test]
    fn inverse_matrix_inverts() {
        assert!((camera().matrix() * camera().inverse_matrix() - Matrix3::identity()).norm() < 1e-12);
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(PinholeCamera { fx: -1.0, ..camera() }.validate().is_err());
        assert!(PinholeCamera { cx: 5000.0, ..camera() }.validate().is_err());
        assert!(PinholeCamera { fy: f64::NAN, ..camera() }.validate().is_err());
        assert!(camera().validate().is_ok());
    }
}
