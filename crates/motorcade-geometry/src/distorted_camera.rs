//! A camera with a distorting lens, and the pinhole its frames are resampled to.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point2, Point3};

use crate::camera::{InvalidCamera, PinholeCamera};
use crate::distortion::Distortion;

/// Widest horizontal view a pinhole takes from a fisheye or rational lens when none is stated \[rad\]: 100°. Wider ones
/// stretch the border: at 50° from the axis by 1 / cos² 50° = 2.4, at 60° by 4.
const DEFAULT_VIEW_RAD: f64 = 100.0 * std::f64::consts::PI / 180.0;

/// A camera with a distorting lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortedCamera {
    matrix: PinholeCamera,
    distortion: Distortion,
    /// Largest x² + y² of a ray (x, y, 1) in the monotone part of the model.
    largest_r2: f64,
}

impl DistortedCamera {
    /// From the camera matrix with the image size, and the lens.
    ///
    /// # Errors
    /// What [`PinholeCamera::validate`] and [`Distortion::validate`] refuse.
    pub fn new(matrix: PinholeCamera, distortion: Distortion) -> Result<Self, InvalidCamera> {
        matrix.validate()?;
        distortion.validate()?;
        let largest = distortion.largest_angle_rad();
        let largest_r2 = if largest < FRAC_PI_2 { largest.tan().powi(2) } else { f64::INFINITY };
        Ok(Self { matrix, distortion, largest_r2 })
    }
    /// Camera matrix and image size.
    pub fn matrix(&self) -> &PinholeCamera {
        &self.matrix
    }
    /// The lens.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }
    /// The pixel in which the ray (x, y, 1) is seen; `None` beyond the monotone part of the model, where the polynomials would
    /// show the middle of the picture again.
    #[inline]
    pub fn pixel(&self, x: f64, y: f64) -> Option<Point2<f64>> {
        let r2 = x * x + y * y;
        if r2.is_nan() || r2 > self.largest_r2 {
            return None;
        }
        let (dx, dy) = self.distortion.distort(x, y);
        let camera = &self.matrix;
        Some(Point2::new(dx * camera.fx + camera.cx, dy * camera.fy + camera.cy))
    }
    /// Projects a point in the camera frame; `None` behind the camera, at 90° from its axis and where [`pixel`](Self::pixel) is.
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        let p = point_in_camera;
        // One millimetre, as `PinholeCamera::project`.
        (p.z > 1e-3).then(|| self.pixel(p.x / p.z, p.y / p.z)).flatten()
    }
    /// Angle between the rays of the left and right border in the row of the principal point \[rad\].
    pub fn horizontal_view_rad(&self) -> f64 {
        let camera = &self.matrix;
        let (left, right) = (camera.cx + 0.5, f64::from(camera.width) - 0.5 - camera.cx);
        self.distortion.angle_rad(left / camera.fx) + self.distortion.angle_rad(right / camera.fx)
    }
    /// The pinhole of the same image size that the frames are resampled to.
    ///
    /// With a stated horizontal view \[rad\], and for fisheye lenses, it has square pixels, the principal point in the middle, and
    /// that view, by default the lens's own but at most 100°. Otherwise it is the camera matrix; a rational lens keeps its matrix
    /// where the view by it is at most 100°.
    ///
    /// # Errors
    /// A view no pinhole has.
    pub fn undistorted(&self, view_rad: Option<f64>) -> Result<PinholeCamera, InvalidCamera> {
        let keeps_matrix = match self.distortion {
            Distortion::RadialTangential(_) => true,
            Distortion::Rational(_) => self.matrix.field_of_view_rad().0 <= DEFAULT_VIEW_RAD,
            Distortion::Fisheye(_) => false,
        };
        let view_rad = match view_rad {
            None if keeps_matrix => return Ok(self.matrix),
            None => self.horizontal_view_rad().min(DEFAULT_VIEW_RAD),
            Some(view_rad) => view_rad,
        };
        let (width, height) = (self.matrix.width, self.matrix.height);
        let focal = 0.5 * f64::from(width) / (0.5 * view_rad).tan();
        let middle = |side: u32| 0.5 * (f64::from(side) - 1.0);
        let camera =
            PinholeCamera { fx: focal, fy: focal, cx: middle(width), cy: middle(height), width, height };
        camera.validate()?;
        Ok(camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distortion::{Fisheye, RadialTangential, Rational};

    const MATRIX: PinholeCamera =
        PinholeCamera { fx: 285.0, fy: 286.0, cx: 420.5, cy: 400.7, width: 848, height: 800 };

    fn fisheye() -> DistortedCamera {
        let t265 = Fisheye { k1: -0.0053, k2: 0.0423, k3: -0.0395, k4: 0.0068 };
        DistortedCamera::new(MATRIX, Distortion::Fisheye(t265)).unwrap()
    }

    #[test]
    fn angles_and_radii_are_inverse() {
        let lens = fisheye();
        for angle in [0.0, 1e-6, 0.3, 1.2, 1.4] {
            let back = lens.distortion().angle_rad(lens.distortion().radius(angle));
            assert!((back - angle).abs() < 1e-12, "{angle}: {back}");
        }
    }

    #[test]
    fn a_fisheye_becomes_a_pinhole_of_100_degrees() {
        let lens = fisheye();
        assert!(lens.horizontal_view_rad().to_degrees() > 160.0);
        let pinhole = lens.undistorted(None).unwrap();
        assert!((pinhole.field_of_view_rad().0.to_degrees() - 100.0).abs() < 1e-9);
        assert_eq!((pinhole.cx, pinhole.cy, pinhole.width, pinhole.height), (423.5, 399.5, 848, 800));
        let narrow =
            DistortedCamera::new(PinholeCamera { fx: 900.0, fy: 900.0, ..MATRIX }, *lens.distortion())
                .unwrap();
        let view = narrow.undistorted(None).unwrap().field_of_view_rad().0;
        assert!((view - narrow.horizontal_view_rad()).abs() < 1e-12 && view < 1.0, "{view}");
        let stated = lens.undistorted(Some(1.2)).unwrap().field_of_view_rad().0;
        assert!((stated - 1.2).abs() < 1e-12);
        assert!(lens.undistorted(Some(3.1)).unwrap_err().to_string().contains("fx"));
    }

    #[test]
    fn other_lenses_keep_a_camera_matrix_that_is_not_too_wide() {
        let plain = Distortion::RadialTangential(RadialTangential { k1: -0.2, ..Default::default() });
        let rational = Distortion::Rational(Rational { k1: 0.5, k4: 0.7, ..Default::default() });
        let with = |fx: f64, lens| DistortedCamera::new(PinholeCamera { fx, ..MATRIX }, lens).unwrap();
        for (fx, lens, kept) in
            [(285.0, plain, true), (600.0, plain, true), (285.0, rational, false), (600.0, rational, true)]
        {
            let camera = with(fx, lens);
            assert_eq!(camera.undistorted(None).unwrap() == *camera.matrix(), kept, "{fx} {lens:?}");
        }
    }

    #[test]
    fn what_the_lens_does_not_show_has_no_pixel() {
        let lens = fisheye();
        assert!(lens.project(&Point3::new(0.1, 0.1, 1.0)).is_some());
        assert!(lens.project(&Point3::new(0.1, 0.1, -1.0)).is_none());
        assert!(lens.project(&Point3::new(1.0, 0.0, 0.0)).is_none());
        assert!(lens.pixel(f64::NAN, 0.0).is_none());
        // Each of these turns back at r = 1: what lies beyond would be seen a second time.
        for turning in [
            Distortion::RadialTangential(RadialTangential { k1: -1.0 / 3.0, ..Default::default() }),
            Distortion::Rational(Rational { k4: 1.0, ..Default::default() }),
            Distortion::Fisheye(Fisheye {
                k1: -1.0 / (3.0 * (std::f64::consts::FRAC_PI_4).powi(2)),
                ..Default::default()
            }),
        ] {
            let lens = DistortedCamera::new(MATRIX, turning).unwrap();
            assert!(lens.pixel(0.999, 0.0).is_some() && lens.pixel(1.001, 0.0).is_none(), "{turning:?}");
            assert!((turning.largest_angle_rad() - std::f64::consts::FRAC_PI_4).abs() < 1e-12, "{turning:?}");
        }
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |lens| DistortedCamera::new(MATRIX, lens).unwrap_err().to_string();
        let fisheye = |k4| Distortion::Fisheye(Fisheye { k4, ..Default::default() });
        assert!(refused(fisheye(f64::NAN)).contains("k4 = NaN"));
        assert!(refused(fisheye(-1e9)).contains("k4 = -1e9"));
        let other = Distortion::Fisheye(Fisheye { k1: -300.0, ..Default::default() });
        assert!(refused(other).contains("k1 .. k4"));
        let rational = Distortion::Rational(Rational { k6: f64::INFINITY, ..Default::default() });
        assert!(refused(rational).contains("k6"));
    }
}
