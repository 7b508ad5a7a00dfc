//! From the camera frame into the image, clipped to what can be drawn.

use motorcade_geometry::PinholeCamera;
use nalgebra::Point3;

use crate::segment::{Pixel, Rectangle, Segment, cut};

/// Depth of the nearest points that are drawn \[m\]: nearer ones lie far outside of the image.
const NEAR_M: f64 = 0.3;
/// Lines are drawn this far beyond the image, so that their ends are not seen \[px\].
const MARGIN_PX: f64 = 20.0;

/// Projection into the image of one camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    camera: PinholeCamera,
}

impl View {
    pub(crate) fn new(camera: PinholeCamera) -> Self {
        Self { camera }
    }

    /// The image \[px\], pixel centres at integer coordinates.
    pub(crate) fn image(&self) -> Rectangle {
        let (width, height) = (f64::from(self.camera.width), f64::from(self.camera.height));
        Rectangle::new(-0.5, -0.5, width - 0.5, height - 0.5)
    }

    fn drawn(&self) -> Rectangle {
        let image = self.image();
        let m = MARGIN_PX;
        Rectangle::new(image.x1 - m, image.y1 - m, image.x2 + m, image.y2 + m)
    }

    /// Pixel of a point; `None` too near or behind the camera. It may lie outside of the image.
    pub(crate) fn point(&self, point: &Point3<f64>) -> Option<Pixel> {
        if point.z < NEAR_M {
            return None;
        }
        self.camera.project(point).map(|p| [p.x, p.y])
    }

    /// The visible part of a segment.
    pub(crate) fn segment(&self, a: &Point3<f64>, b: &Point3<f64>) -> Option<Segment> {
        let (a, b) = (toward(a, b), toward(b, a));
        self.drawn().clip(&[self.point(&a)?, self.point(&b)?])
    }

    /// The visible part of a convex polygon; empty where there is none.
    pub(crate) fn polygon(&self, corners: &[Point3<f64>]) -> Vec<Pixel> {
        self.drawn().clip_polygon(self.outline(corners))
    }

    /// A convex polygon in front of the camera, not clipped to the image.
    pub(crate) fn outline(&self, corners: &[Point3<f64>]) -> Vec<Pixel> {
        let ahead = cut(corners, |p| p.z - NEAR_M, |a, b, t| a + (b - a) * t);
        ahead.iter().filter_map(|p| self.camera.project(p).map(|p| [p.x, p.y])).collect()
    }
}

/// The first point, moved towards the second one until it is far enough ahead.
fn toward(a: &Point3<f64>, b: &Point3<f64>) -> Point3<f64> {
    if a.z >= NEAR_M || b.z <= NEAR_M {
        return *a;
    }
    let point = a + (b - a) * ((NEAR_M - a.z) / (b.z - a.z));
    Point3::new(point.x, point.y, NEAR_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View::new(PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0, width: 100, height: 80 })
    }

    #[test]
    fn segments_are_cut_where_they_pass_the_camera() {
        let ahead = Point3::new(0.0, 1.0, 10.0);
        let [a, b] = view().segment(&ahead, &Point3::new(0.0, 1.0, -10.0)).unwrap();
        assert_eq!(a, [50.0, 50.0]);
        assert!((b[0] - 50.0).abs() < 1e-9 && b[1] > 80.0 && b[1] < 101.0, "{b:?}");
        let beside = Point3::new(30.0, 0.0, -1.0);
        assert_eq!(view().segment(&beside, &Point3::new(30.0, 0.0, -9.0)), None);
        assert_eq!(view().point(&beside), None);
    }

    #[test]
    fn polygons_around_the_camera_stay_near_the_image() {
        let square = [(-5.0, -3.0), (5.0, -3.0), (5.0, 30.0), (-5.0, 30.0)];
        let corners = square.map(|(x, z)| Point3::new(x, 1.5, z));
        let polygon = view().polygon(&corners);
        assert!(polygon.len() >= 4 && polygon.iter().flatten().all(|v| v.abs() < 150.0), "{polygon:?}");
    }
}
