//! Labels of vehicles.

use crate::canvas::{Canvas, Pen};
use crate::colour::{BLACK, WHITE};
use crate::layout::Layout;
use crate::placement::Placement;
use crate::scene::{Road, SceneVehicle};
use crate::segment::Rectangle;
use crate::text::width_px;
use crate::vehicle::{Placed, colour};

/// Vehicles lower than this in the image have one line \[capital heights\].
const SMALL: f64 = 2.5;

/// Identity, class and speed; distance ahead along the road with its standard deviation.
fn lines(vehicle: &SceneVehicle, road: &Road, small: bool) -> Vec<String> {
    let (ahead, _) = road.axes();
    let [distance_m, _] = road.ahead_and_right(&vehicle.position());
    let sigma_m = vehicle.sigma_along_m(&ahead);
    let speed = if vehicle.moving { kmh(vehicle.speed_mps) } else { "parked".to_owned() };
    let distance = format!("{distance_m:.1} ±{sigma_m:.1} m");
    if small {
        return vec![format!("{} {distance}", vehicle.id)];
    }
    vec![format!("{} {} {speed}", vehicle.id, vehicle.class), distance]
}

/// A speed in whole kilometres an hour.
pub(crate) fn kmh(speed_mps: f64) -> String {
    let rounded = (3.6 * speed_mps).round();
    // No minus before zero.
    format!("{:.0} km/h", if rounded == 0.0 { 0.0 } else { rounded })
}

/// Draws the label of a vehicle where there is room.
pub(crate) fn draw(
    canvas: &mut Canvas,
    placed: &Placed<'_>,
    road: &Road,
    layout: &Layout,
    placement: &mut Placement,
) {
    let capital = layout.capital_px;
    let small = placed.height_px < SMALL * capital;
    let lines = lines(placed.vehicle, road, small);
    let capital = if small { 0.85 * capital } else { capital };
    let (margin, pitch) = (0.5 * capital, 1.6 * capital);
    let widest = lines.iter().map(|line| width_px(line, capital)).fold(0.0, f64::max);
    let size =
        (widest + 2.0 * margin + 0.5 * capital, pitch * (lines.len() - 1) as f64 + capital + 2.0 * margin);
    let Some(place) = placement.around(&placed.bounds, size) else { return };
    let colour = colour(placed.vehicle);
    let middle = |r: &Rectangle| 0.5 * (r.x1 + r.x2);
    if placed.bounds.y1 - place.y2 > size.1 {
        let leader = [[middle(&place), place.y2], [middle(&placed.bounds), placed.bounds.y1]];
        canvas.lines([leader.as_slice()], &Pen::new(colour.faded(0.8), layout.line_px).seamed(0.4));
    }
    canvas.rectangle(&place, BLACK.faded(0.5));
    let bar = Rectangle::new(place.x1, place.y1, place.x1 + 0.35 * capital, place.y2);
    canvas.rectangle(&bar, colour);
    let ink = if placed.vehicle.predicted { WHITE.faded(0.75) } else { WHITE };
    for (k, line) in lines.iter().enumerate() {
        let baseline = place.y1 + margin + capital + pitch * k as f64;
        canvas.text(line, [place.x1 + margin + 0.5 * capital, baseline], capital, ink);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::tests::car;
    use nalgebra::Vector3;

    #[test]
    fn labels_tell_id_class_speed_and_distance() {
        let road = Road { normal_in_camera: -Vector3::y(), height_m: 1.5 };
        assert_eq!(lines(&car(0.0, 23.44), &road, false), ["3 Car 36 km/h", "23.4 ±0.4 m"]);
        let parked = SceneVehicle { moving: false, ..car(0.0, 23.44) };
        assert_eq!(lines(&parked, &road, false)[0], "3 Car parked");
        assert_eq!(lines(&parked, &road, true), ["3 23.4 ±0.4 m"]);
        assert_eq!(kmh(-0.01), "0 km/h");
        assert_eq!(kmh(-3.0), "-11 km/h");
    }
}
