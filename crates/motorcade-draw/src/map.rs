//! The map from above: the camera at the bottom, its direction of view up.

use nalgebra::Point3;

use crate::canvas::{Canvas, Pen};
use crate::colour::{Colour, WHITE};
use crate::layout::Layout;
use crate::scene::{Scene, SceneVehicle, ahead_and_right};
use crate::segment::{Pixel, Rectangle};
use crate::text::width_px;
use crate::trail::on_road;
use crate::vehicle::colour;

/// Distance ahead and behind that the map shows \[m\].
const AHEAD_M: f64 = 60.0;
const BEHIND_M: f64 = 5.0;
/// Distance between two rings \[m\].
const RING_M: f64 = 20.0;
/// Place of the numbers on the rings: at this share of the way from the camera to the right end of the map, but not farther around the
/// ring than this direction, to the right of ahead \[rad\]. Vehicles are in the middle.
const NUMBERS_SHARE: f64 = 0.72;
const NUMBERS_MOST_RAD: f64 = 1.0;
/// Half axes of the ellipses in standard deviations.
const ELLIPSE_SIGMAS: f64 = 2.0;

/// From metres on the road to pixels.
struct Map<'a> {
    scene: &'a Scene,
    area: Rectangle,
    camera: Pixel,
    px_per_m: f64,
}

/// Draws the map into a part of the panel.
pub(crate) fn draw(canvas: &mut Canvas, scene: &Scene, area: Rectangle, layout: &Layout) {
    let px_per_m = (area.y2 - area.y1) / (AHEAD_M + BEHIND_M);
    let camera = [0.5 * (area.x1 + area.x2), area.y2 - BEHIND_M * px_per_m];
    let map = Map { scene, area, camera, px_per_m };
    map.rings(canvas, layout);
    let mut vehicles: Vec<&SceneVehicle> = scene.vehicles.iter().filter(|v| v.is_drawable()).collect();
    vehicles.sort_by_key(|v| v.id);
    for vehicle in vehicles {
        map.vehicle(canvas, vehicle, layout);
    }
    map.arrow(canvas, layout);
}

impl Map<'_> {
    fn at(&self, [ahead, right]: [f64; 2]) -> Pixel {
        [self.camera[0] + right * self.px_per_m, self.camera[1] - ahead * self.px_per_m]
    }

    /// A line cut to the map.
    fn line(&self, canvas: &mut Canvas, points: &[Pixel], pen: &Pen) {
        let parts: Vec<_> = points.windows(2).filter_map(|p| self.area.clip(&[p[0], p[1]])).collect();
        // One line where nothing is cut: dashes then run on around corners.
        if parts.len() + 1 == points.len() && parts.iter().zip(points.windows(2)).all(|(a, b)| a == b) {
            canvas.lines([points], pen);
        } else {
            canvas.lines(parts.iter().map(<[_; 2]>::as_slice), pen);
        }
    }

    fn rings(&self, canvas: &mut Canvas, layout: &Layout) {
        let pen = Pen::new(WHITE.faded(0.25), 0.8 * layout.line_px);
        let size = 0.7 * layout.capital_px;
        let rings = (AHEAD_M / RING_M).round() as u32;
        for radius_m in (1..=rings).map(|k| f64::from(k) * RING_M) {
            let on_ring = |k: i32| {
                let (sin, cos) = f64::from(k * 3).to_radians().sin_cos();
                self.at([radius_m * cos, radius_m * sin])
            };
            let points: Vec<Pixel> = (-35..=35).map(on_ring).collect();
            self.line(canvas, &points, &pen);
            let text = format!("{radius_m:.0} m");
            let aside = NUMBERS_SHARE * (self.area.x2 - self.camera[0]) / (radius_m * self.px_per_m);
            let (sin, cos) = aside.min(1.0).asin().min(NUMBERS_MOST_RAD).sin_cos();
            let [x, y] = self.at([radius_m * cos, radius_m * sin]);
            let start = [x - 0.5 * width_px(&text, size), y + 1.7 * size];
            canvas.text(&text, start, size, WHITE.faded(0.55));
        }
    }

    fn vehicle(&self, canvas: &mut Canvas, vehicle: &SceneVehicle, layout: &Layout) {
        let road = &self.scene.road;
        let place = |p: &Point3<f64>| self.at(ahead_and_right(road, p));
        let [length, width, _] = vehicle.size_m;
        let corner =
            |x: f64, y: f64| place(&vehicle.camera_from_vehicle.transform_point(&Point3::new(x, y, 0.0)));
        let (l, w) = (0.5 * length, 0.5 * width);
        let body = [corner(l, w), corner(l, -w), corner(-l, -w), corner(-l, w), corner(l, w)];
        let centre = place(&vehicle.position());
        if self.area.clip_polygon(body[..4].to_vec()).is_empty() {
            return;
        }
        let colour = colour(vehicle);
        let trail: Vec<Pixel> = on_road(vehicle, road).iter().map(place).collect();
        self.line(canvas, &trail, &Pen::new(colour.faded(0.5), layout.line_px));
        let nose = corner(l, 0.0);
        let turn = (nose[1] - centre[1]).atan2(nose[0] - centre[0]);
        self.ellipse(
            canvas,
            centre,
            vehicle.sigma_m,
            turn,
            &Pen::new(colour.faded(0.6), 0.8 * layout.line_px),
        );
        let dash = (!vehicle.moving).then_some([2.0 * layout.line_px; 2]);
        canvas.polygon(&self.area.clip_polygon(body[..4].to_vec()), colour.faded(0.35));
        self.line(canvas, &body, &Pen::new(colour, layout.line_px).dashed(dash));
        self.line(canvas, &[centre, nose], &Pen::new(colour, layout.line_px));
        self.id(canvas, vehicle, &body, layout);
    }

    fn ellipse(&self, canvas: &mut Canvas, centre: Pixel, sigma_m: [f64; 2], turn: f64, pen: &Pen) {
        let half = sigma_m.map(|s| ELLIPSE_SIGMAS * s * self.px_per_m);
        let reach = half[0].max(half[1]);
        let around =
            Rectangle::new(centre[0] - reach, centre[1] - reach, centre[0] + reach, centre[1] + reach);
        // Cut ellipses would be drawn over the image.
        if self.area.common(&around) == Some(around) {
            canvas.ellipse(centre, half, turn, pen);
        }
    }

    /// The identity beside the body, where it stays on the map.
    fn id(&self, canvas: &mut Canvas, vehicle: &SceneVehicle, body: &[Pixel], layout: &Layout) {
        let Some(around) = Rectangle::around(body.iter().copied()) else { return };
        let (text, size) = (vehicle.id.to_string(), 0.75 * layout.capital_px);
        let (x, y) = (around.x2 + 0.5 * size, 0.5 * (around.y1 + around.y2 + size));
        let place = Rectangle::new(x, y - size, x + width_px(&text, size), y);
        if self.area.common(&place) == Some(place) {
            // Lighter than the body: dark blue letters would not be read on the panel.
            let ink =
                Colour { opacity: colour(vehicle).opacity, ..Colour::from_hue(vehicle.hue_deg, 0.9, 0.75) };
            canvas.text(&text, [x, y], size, ink);
        }
    }

    /// The camera.
    fn arrow(&self, canvas: &mut Canvas, layout: &Layout) {
        let [x, y] = self.camera;
        let size = 0.7 * layout.capital_px;
        let corners =
            [[x, y - 1.2 * size], [x + 0.7 * size, y + 0.8 * size], [x - 0.7 * size, y + 0.8 * size]];
        canvas.polygon(&corners, Colour::gray(235));
    }
}
