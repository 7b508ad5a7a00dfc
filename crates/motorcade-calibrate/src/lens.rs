//! The unknown lens.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Point2, Vector2, Vector3, Vector4};

/// A lens with square pixels: `x = f d(r) X/Z + cx`, `y = f d(r) Y/Z + cy` with `d = 1 + k1 r²`, `r² = (X² + Y²) / Z²`; the first term
/// of OpenCV's radial model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal length \[px\].
    pub focal_px: f64,
    /// Radial distortion.
    pub k1: f64,
    /// Principal point x \[px\].
    pub cx: f64,
    /// Principal point y \[px\].
    pub cy: f64,
}

/// A projected point and its derivatives.
pub(crate) struct Projection {
    /// The image \[px\].
    pub pixel: Point2<f64>,
    /// By the point in the camera.
    pub by_point: Matrix2x3<f64>,
    /// By the parameters: ln f, k1, cx, cy.
    pub by_lens: Matrix2x4<f64>,
}

/// Least depth as a share of the distance from the axis: beyond about 84° from it nothing is seen. A bound of the lens model, which has no options.
const LEAST_DEPTH: f64 = 0.1;

impl Lens {
    /// A lens without distortion and with its axis in the middle of the picture.
    pub fn centred(focal_px: f64, width: u32, height: u32) -> Self {
        let middle = |side: u32| 0.5 * (f64::from(side) - 1.0);
        Self { focal_px, k1: 0.0, cx: middle(width), cy: middle(height) }
    }

    /// The pinhole without its distortion.
    pub fn pinhole(&self, width: u32, height: u32) -> PinholeCamera {
        PinholeCamera { fx: self.focal_px, fy: self.focal_px, cx: self.cx, cy: self.cy, width, height }
    }

    /// After a step of ln f, k1, cx, cy.
    pub(crate) fn moved(&self, step: &Vector4<f64>) -> Self {
        Self {
            focal_px: self.focal_px * step[0].exp(),
            k1: self.k1 + step[1],
            cx: self.cx + step[2],
            cy: self.cy + step[3],
        }
    }

    /// Projects a point; `None` behind the camera and far beside it. Any positive multiple of the point has the same image.
    pub(crate) fn project(&self, point: &Vector3<f64>) -> Option<Projection> {
        if point.z <= LEAST_DEPTH * point.x.hypot(point.y) || point.z <= 1e-9 {
            return None;
        }
        let inverse = 1.0 / point.z;
        let (x, y) = (point.x * inverse, point.y * inverse);
        let r2 = x * x + y * y;
        let d = 1.0 + self.k1 * r2;
        // Beyond it the model would show the middle of the picture again.
        if d + 2.0 * self.k1 * r2 <= 0.0 {
            return None;
        }
        let f = self.focal_px;
        let by_ray = Matrix2::new(
            d + 2.0 * self.k1 * x * x,
            2.0 * self.k1 * x * y,
            2.0 * self.k1 * x * y,
            d + 2.0 * self.k1 * y * y,
        ) * f;
        let ray_by_point = Matrix2x3::new(inverse, 0.0, -x * inverse, 0.0, inverse, -y * inverse);
        let by_lens = Matrix2x4::new(f * d * x, f * r2 * x, 1.0, 0.0, f * d * y, f * r2 * y, 0.0, 1.0);
        Some(Projection {
            pixel: Point2::new(f * d * x + self.cx, f * d * y + self.cy),
            by_point: by_ray * ray_by_point,
            by_lens,
        })
    }

    /// The viewing ray (x, y, 1) of a pixel, by fixed-point iteration.
    pub(crate) fn ray(&self, pixel: &Point2<f64>) -> Vector3<f64> {
        let seen = Vector2::new(pixel.x - self.cx, pixel.y - self.cy) / self.focal_px;
        let mut ray = seen;
        for _ in 0..20 {
            ray = seen / (1.0 + self.k1 * ray.norm_squared()).max(0.2);
        }
        Vector3::new(ray.x, ray.y, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens { focal_px: 700.0, k1: -0.12, cx: 600.0, cy: 190.0 };

    #[test]
    fn derivatives_are_those_of_the_projection() {
        let point = Vector3::new(1.3, -0.7, 2.5);
        let at = LENS.project(&point).unwrap();
        let h = 1e-6;
        for k in 0..3 {
            let mut moved = point;
            moved[k] += h;
            let slope = (LENS.project(&moved).unwrap().pixel - at.pixel) / h;
            assert!((slope - at.by_point.column(k)).norm() < 1e-2, "{k}");
        }
        for k in 0..4 {
            let mut step = Vector4::zeros();
            step[k] = h;
            let slope = (LENS.moved(&step).project(&point).unwrap().pixel - at.pixel) / h;
            assert!((slope - at.by_lens.column(k)).norm() < 1e-2, "{k}");
        }
    }

    #[test]
    fn a_ray_and_its_pixel_are_inverse() {
        let pixel = Point2::new(1100.0, 40.0);
        let found = LENS.project(&LENS.ray(&pixel)).unwrap().pixel;
        assert!((found - pixel).norm() < 1e-6, "{found}");
        assert!(LENS.project(&Vector3::new(0.0, 0.0, -1.0)).is_none());
    }
}
