//! Labels of vehicles.

use motorcade_geometry::RoadPlane;

use crate::canvas::{Canvas, Pen};
use crate::colour::{BLACK, WHITE};
use crate::layout::Layout;
use crate::placement::Placement;
use crate::scene::{SceneVehicle, ahead_and_right};
use crate::segment::Rectangle;
use crate::text::width_px;
use crate::vehicle::{Placed, colour};

/// Vehicles lower than this in the image, and faint ones, have one line, the faint ones without class and speed \[capital heights\].
const SMALL: f64 = 2.5;

/// Margin around the text, width of the coloured bar at its left, distance of two baselines \[capital heights\].
const MARGIN: f64 = 0.5;
const BAR: f64 = 0.5;
const PITCH: f64 = 1.6;

/// Identity, class and speed; distance along the road to the vehicle's centre with its standard deviation.
fn lines(vehicle: &SceneVehicle, road: &RoadPlane, small: bool) -> Vec<String> {
    let [ahead_m, right_m] = ahead_and_right(road, &vehicle.position());
    let distance_m = ahead_m.hypot(right_m);
    let towards = (ahead_m * road.ahead() + right_m * road.right()) / distance_m.max(1e-9);
    let sigma_m = vehicle.sigma_along_m(&towards);
    let doubt = if vehicle.unsure { "?" } else { "" };
    let speed = if vehicle.moving { kmh(vehicle.speed_mps) } else { "parked".to_owned() } + doubt;
    let distance = format!("{distance_m:.1} ±{sigma_m:.1} m");
    match (small, vehicle.faint) {
        (_, true) => vec![format!("{} {distance}", vehicle.id)],
        (true, false) => {
            vec![format!("{} {} {speed} {distance_m:.0} ±{sigma_m:.1} m", vehicle.id, vehicle.class)]
        }
        (false, false) => vec![format!("{} {} {speed}", vehicle.id, vehicle.class), distance],
    }
}

/// A speed in whole kilometres an hour.
pub(crate) fn kmh(speed_mps: f64) -> String {
    let rounded = (3.6 * speed_mps).round();
    // No minus before zero.
    format!("{:.0} km/h", if rounded == 0.0 { 0.0 } else { rounded })
}

/// A label with its place.
pub(crate) struct Label<'a> {
    placed: &'a Placed<'a>,
    lines: Vec<String>,
    /// Height of capitals \[px\].
    capital: f64,
    place: Rectangle,
}

impl<'a> Label<'a> {
    /// The label of a vehicle where there is room.
    pub(crate) fn new(
        placed: &'a Placed<'a>,
        road: &RoadPlane,
        layout: &Layout,
        placement: &mut Placement,
    ) -> Option<Self> {
        let small = placed.height_px < SMALL * layout.capital_px || placed.vehicle.faint;
        let lines = lines(placed.vehicle, road, small);
        let capital = if small { 0.85 } else { 1.0 } * layout.capital_px;
        let widest = lines.iter().map(|line| width_px(line, capital)).fold(0.0, f64::max);
        let width = widest + 2.0 * MARGIN * capital + BAR * capital;
        let height = capital * (PITCH * (lines.len() - 1) as f64 + 1.0 + 2.0 * MARGIN);
        let place = placement.around(&placed.bounds, (width, height))?;
        Some(Self { placed, lines, capital, place })
    }

    /// Draws a line from a label to its vehicle, where they are apart.
    pub(crate) fn draw_leader(&self, canvas: &mut Canvas, layout: &Layout) {
        let (place, bounds) = (&self.place, &self.placed.bounds);
        let middle = |r: &Rectangle| 0.5 * (r.x1 + r.x2);
        let [above, below, left, right] =
            [bounds.y1 - place.y2, place.y1 - bounds.y2, bounds.x1 - place.x2, place.x1 - bounds.x2];
        let line = if above > self.capital {
            Some([[middle(place), place.y2], [middle(bounds), bounds.y1]])
        } else if below > 0.0 {
            Some([[middle(place), place.y1], [middle(bounds), bounds.y2]])
        } else if left.max(right) > self.capital {
            let (from, to) = if left > right { (place.x2, bounds.x1) } else { (place.x1, bounds.x2) };
            Some([[from, 0.5 * (place.y1 + place.y2)], [to, 0.5 * (bounds.y1 + bounds.y2)]])
        } else {
            None
        };
        if let Some(line) = line {
            let pen = Pen::new(colour(self.placed.vehicle).faded(0.8), layout.line_px).seamed(0.4);
            canvas.lines([line.as_slice()], &pen);
        }
    }

    /// Draws the label.
    pub(crate) fn draw(&self, canvas: &mut Canvas) {
        let (place, capital) = (&self.place, self.capital);
        canvas.rectangle(place, BLACK.faded(0.6));
        let bar = Rectangle::new(place.x1, place.y1, place.x1 + 0.7 * BAR * capital, place.y2);
        canvas.rectangle(&bar, colour(self.placed.vehicle));
        let ink = if self.placed.vehicle.faint { WHITE.faded(0.75) } else { WHITE };
        for (k, line) in self.lines.iter().enumerate() {
            let baseline = place.y1 + capital * (MARGIN + 1.0 + PITCH * k as f64);
            canvas.plain_text(line, [place.x1 + capital * (MARGIN + BAR), baseline], capital, ink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::tests::car;

    #[test]
    fn labels_show_id_class_speed_and_distance() {
        let road = RoadPlane::level(1.5);
        assert_eq!(lines(&car(0.0, 23.44), &road, false), ["3 Car 36 km/h", "23.4 ±0.4 m"]);
        let parked = SceneVehicle { moving: false, ..car(0.0, 23.44) };
        assert_eq!(lines(&parked, &road, false)[0], "3 Car parked");
        assert_eq!(lines(&parked, &road, true), ["3 Car parked 23 ±0.4 m"]);
        let faint = SceneVehicle { faint: true, ..car(0.0, 23.44) };
        assert_eq!(lines(&faint, &road, true), ["3 23.4 ±0.4 m"]);
        let unsure = SceneVehicle { unsure: true, ..car(0.0, 23.44) };
        assert_eq!(lines(&unsure, &road, false)[0], "3 Car 36 km/h?");
        let may_move = SceneVehicle { unsure: true, ..parked };
        assert_eq!(lines(&may_move, &road, false)[0], "3 Car parked?");
        // Beside the view: 3 m aside and 4 m ahead are 5 m.
        assert_eq!(lines(&car(3.0, 4.0), &road, false)[1], "5.0 ±0.3 m");
        assert_eq!(kmh(-0.01), "0 km/h");
        assert_eq!(kmh(-3.0), "-11 km/h");
    }
}
