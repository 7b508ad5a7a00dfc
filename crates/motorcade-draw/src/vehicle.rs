//! A vehicle in the image: its cuboid.

use nalgebra::Point3;

use crate::canvas::{Canvas, Pen};
use crate::colour::Colour;
use crate::cuboid::Cuboid;
use crate::layout::Layout;
use crate::scene::SceneVehicle;
use crate::segment::{Pixel, Rectangle, Segment};
use crate::view::View;

/// Opacity of edges that the body hides, and of faint vehicles.
const HIDDEN: f64 = 0.35;
const FAINT: f64 = 0.5;

/// Width of a vehicle's outline \[px\] by the standard deviation of its position on the road \[m\]: `line_px` where that is 0, `line_px`
/// more for every metre of it, at most four times `line_px`, and at most a twelfth of the vehicle's height in the image but as much as
/// twice `line_px`: those far away are known least.
pub fn outline_width_px(sigma_m: f64, line_px: f64, height_px: f64) -> f64 {
    let wide = line_px * (1.0 + sigma_m.clamp(0.0, 3.0));
    wide.min((height_px / 12.0).max(2.0 * line_px))
}

/// Colour of a vehicle: strong where it moves.
pub(crate) fn colour(vehicle: &SceneVehicle) -> Colour {
    let (saturation, lightness) = if vehicle.moving { (0.95, 0.58) } else { (0.55, 0.68) };
    let colour = Colour::from_hue(vehicle.hue_deg, saturation, lightness);
    if vehicle.faint { colour.faded(FAINT) } else { colour }
}

/// A vehicle with its place in the image.
pub(crate) struct Placed<'a> {
    pub(crate) vehicle: &'a SceneVehicle,
    pub(crate) cuboid: Cuboid,
    /// Around its cuboid, cut to the image \[px\].
    pub(crate) bounds: Rectangle,
    /// Height of the cuboid, not cut to the image \[px\].
    pub(crate) height_px: f64,
}

impl<'a> Placed<'a> {
    /// `None` for a vehicle outside of the image, beside or behind the camera.
    pub(crate) fn new(vehicle: &'a SceneVehicle, view: &View) -> Option<Self> {
        if !vehicle.is_drawable() {
            return None;
        }
        let cuboid = Cuboid::new(&vehicle.camera_from_vehicle, vehicle.size_m);
        if cuboid.holds_camera() {
            return None;
        }
        let around = |of: &dyn Fn(&[Point3<f64>; 4]) -> Vec<Pixel>| {
            Rectangle::around(cuboid.faces().iter().flat_map(of))
        };
        let bounds = around(&|face| view.polygon(face))?.common(&view.image())?;
        let whole = around(&|face| view.outline(face))?;
        Some(Self { vehicle, cuboid, bounds, height_px: whole.y2 - whole.y1 })
    }

    /// Draws the cuboid: edges that the body hides fainter, the front filled and a line on the ground towards it.
    pub(crate) fn draw(&self, canvas: &mut Canvas, view: &View, layout: &Layout) {
        let colour = colour(self.vehicle);
        let width = outline_width_px(self.vehicle.position_sigma_m(), layout.line_px, self.height_px);
        let dash =
            (!self.vehicle.moving).then_some([3.0 * layout.line_px + width, 2.0 * layout.line_px + width]);
        let front = view.polygon(&self.cuboid.front());
        canvas.polygon(&front, colour.faded(if self.cuboid.front_is_seen() { 0.28 } else { 0.12 }));
        let segments = |edges: &mut dyn Iterator<Item = [Point3<f64>; 2]>| -> Vec<Segment> {
            edges.filter_map(|[a, b]| view.segment(&a, &b)).collect()
        };
        let hidden = segments(&mut self.cuboid.edges(false));
        let seen = segments(&mut self.cuboid.edges(true));
        let nose = segments(&mut std::iter::once(self.cuboid.nose()));
        let fine = Pen::new(colour.faded(HIDDEN), layout.line_px).dashed(dash);
        canvas.lines(hidden.iter().map(<[_; 2]>::as_slice), &fine);
        canvas.lines(nose.iter().map(<[_; 2]>::as_slice), &Pen::new(colour.faded(0.7), layout.line_px));
        let pen = Pen::new(colour, width).dashed(dash).seamed(0.6 * layout.line_px);
        canvas.lines(seen.iter().map(<[_; 2]>::as_slice), &pen);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::tests::car;
    use motorcade_geometry::PinholeCamera;

    const VIEW: PinholeCamera =
        PinholeCamera { fx: 400.0, fy: 400.0, cx: 300.0, cy: 100.0, width: 600, height: 200 };

    #[test]
    fn a_car_straight_ahead_is_where_its_corners_project() {
        let vehicle = car(0.0, 20.0);
        let placed = Placed::new(&vehicle, &View::new(VIEW)).unwrap();
        // The rear is 18 m ahead: 0.9 m aside, 1.5 m below and 0.1 m above the camera's axis.
        let expected = [300.0 - 20.0, 100.0 - 400.0 * 0.1 / 18.0, 300.0 + 20.0, 100.0 + 400.0 * 1.5 / 18.0];
        let Rectangle { x1, y1, x2, y2 } = placed.bounds;
        for (found, wanted) in [x1, y1, x2, y2].iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-9, "{:?}", placed.bounds);
        }
        assert!((placed.height_px - (expected[3] - expected[1])).abs() < 1e-9);
    }

    #[test]
    fn vehicles_beside_behind_and_around_the_camera_are_cut_or_left_out() {
        let view = View::new(VIEW);
        for (right, ahead) in [(0.0, -10.0), (4.0, -6.0), (0.0, 0.5), (0.0, 0.0), (60.0, 1.0)] {
            assert!(Placed::new(&car(right, ahead), &view).is_none(), "{right} {ahead}");
        }
        // Half of it is beside the camera, the other half ahead.
        let beside = car(2.2, 1.0);
        let placed = Placed::new(&beside, &view).unwrap();
        assert!(placed.bounds.x2 <= 599.5 && placed.bounds.y2 <= 199.5, "{:?}", placed.bounds);
    }

    #[test]
    fn outlines_grow_with_the_standard_deviation() {
        assert_eq!(outline_width_px(0.0, 1.5, 100.0), 1.5);
        assert_eq!(outline_width_px(1.0, 1.5, 100.0), 3.0);
        assert_eq!(outline_width_px(50.0, 1.5, 100.0), 6.0);
        assert_eq!(outline_width_px(50.0, 1.5, 48.0), 4.0, "thinner on a small vehicle");
        assert_eq!(outline_width_px(50.0, 1.5, 2.0), 3.0);
    }
}
