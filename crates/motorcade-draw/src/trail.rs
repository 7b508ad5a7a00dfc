//! The way a vehicle has come, on the road.

use motorcade_geometry::RoadPlane;
use nalgebra::Point3;

use crate::canvas::{Canvas, Pen};
use crate::colour::Colour;
use crate::layout::Layout;
use crate::scene::SceneVehicle;
use crate::segment::Pixel;
use crate::view::View;

/// Steps in which a trail fades towards its old end.
const FADES: usize = 4;

/// Ground-contact positions on the road as far as the frame knows it: from its plane at the camera up or down to the present position of the
/// vehicle. The estimated heights of single frames would make the trail leave the road.
pub(crate) fn on_road(vehicle: &SceneVehicle, road: &RoadPlane) -> Vec<Point3<f64>> {
    let n = road.up;
    let (at, level) = (vehicle.position(), -road.height_m);
    let above_plane_m = n.dot(&at.coords) - level;
    let distance_m = |p: &Point3<f64>| (p.coords - n * n.dot(&p.coords)).norm();
    let reach_m = distance_m(&at).max(1e-6);
    let dropped = |p: &Point3<f64>| {
        let share = (distance_m(p) / reach_m).min(1.0);
        p + n * (level + share * above_plane_m - n.dot(&p.coords))
    };
    vehicle.trail_in_camera.iter().map(dropped).collect()
}

/// Draws the trail of a moving vehicle, fading towards its old end.
pub(crate) fn draw(
    canvas: &mut Canvas,
    view: &View,
    vehicle: &SceneVehicle,
    colour: Colour,
    road: &RoadPlane,
    layout: &Layout,
) {
    let points = on_road(vehicle, road);
    let count = points.len();
    for fade in 0..FADES {
        // Neighbouring parts share a point.
        let (from, to) = (fade * count / FADES, ((fade + 1) * count / FADES + 1).min(count));
        let Some(part) = points.get(from..to) else { continue };
        let segments: Vec<_> = part.windows(2).filter_map(|p| view.segment(&p[0], &p[1])).collect();
        let lines = joined(&segments);
        let opacity = (fade + 1) as f64 / FADES as f64;
        let pen = Pen::new(colour.faded(0.85 * opacity), 1.6 * layout.line_px).seamed(0.5 * layout.line_px);
        canvas.lines(lines.iter().map(Vec::as_slice), &pen);
    }
}

/// Segments that meet, as one line each.
fn joined(segments: &[[Pixel; 2]]) -> Vec<Vec<Pixel>> {
    let mut lines: Vec<Vec<Pixel>> = Vec::new();
    for [a, b] in segments {
        match lines.last_mut() {
            Some(line) if line.last() == Some(a) => line.push(*b),
            _ => lines.push(vec![*a, *b]),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::tests::car;

    #[test]
    fn a_trail_leads_over_the_road_to_its_vehicle() {
        let trail =
            vec![Point3::new(0.0, 0.9, 5.0), Point3::new(0.0, 1.9, 10.0), Point3::new(0.0, 1.0, 30.0)];
        let vehicle = SceneVehicle { trail_in_camera: trail, ..car(0.0, 20.0) };
        // The vehicle stands 0.4 m above the plane of the road at the camera, 20 m ahead.
        let road = RoadPlane::level(1.9);
        let points = on_road(&vehicle, &road);
        let depths: Vec<f64> = points.iter().map(|p| p.y).collect();
        for (depth, expected) in depths.iter().zip([1.8, 1.7, 1.5]) {
            assert!((depth - expected).abs() < 1e-12, "{depths:?}");
        }
        assert_eq!(points[0].z, 5.0);
    }

    #[test]
    fn segments_that_meet_are_one_line() {
        let lines = joined(&[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [2.0, 0.0]], [[5.0, 0.0], [6.0, 0.0]]]);
        assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [3, 2]);
    }
}
