//! A metric grid on the road.

use motorcade_geometry::RoadPlane;
use nalgebra::Point3;

use crate::canvas::{Canvas, Pen};
use crate::colour::WHITE;
use crate::layout::Layout;
use crate::segment::{Rectangle, Segment, outside};
use crate::view::View;

/// Farthest line ahead and distance between two \[m\].
const FARTHEST_M: f64 = 40.0;
const STEP_AHEAD_M: f64 = 5.0;
/// Lines on each side and distance between two \[m\]: half a lane.
const ASIDE: i32 = 4;
const STEP_ASIDE_M: f64 = 1.75;
/// Opacity of the lines, and of every second distance, which has a number.
const FAINT: f64 = 0.34;
const CLEARER: f64 = 0.55;

/// Draws the grid but where vehicles are.
pub(crate) fn draw(
    canvas: &mut Canvas,
    view: &View,
    road: &RoadPlane,
    layout: &Layout,
    vehicles: &[Rectangle],
) {
    let (foot, ahead, right) = (Point3::from(road.foot()), road.ahead(), road.right());
    let at = |z: f64, x: f64| -> Point3<f64> { foot + z * ahead + x * right };
    let half_m = f64::from(ASIDE) * STEP_ASIDE_M;
    let mut along: Vec<Segment> = Vec::new();
    for k in -ASIDE..=ASIDE {
        let x = f64::from(k) * STEP_ASIDE_M;
        along.extend(view.segment(&at(0.0, x), &at(FARTHEST_M, x)));
    }
    let (mut faint, mut clearer) = (along, Vec::new());
    let steps = (FARTHEST_M / STEP_AHEAD_M).round() as u32;
    for k in 1..=steps {
        let z = f64::from(k) * STEP_AHEAD_M;
        let Some(line) = view.segment(&at(z, -half_m), &at(z, half_m)) else { continue };
        if k.is_multiple_of(2) {
            clearer.push(line);
            // At the left end where the right one is hidden or outside.
            let right_end = number(canvas, view, layout, (&at(z, half_m), z), vehicles, Side::Right);
            if !right_end {
                number(canvas, view, layout, (&at(z, -half_m), z), vehicles, Side::Left);
            }
        } else {
            faint.push(line);
        }
    }
    for (lines, opacity) in [(faint, FAINT), (clearer, CLEARER)] {
        let seen: Vec<Segment> = lines.iter().flat_map(|line| outside(line, vehicles)).collect();
        let pen = Pen::new(WHITE.faded(opacity), 0.8 * layout.line_px).seamed(0.4 * layout.line_px);
        canvas.lines(seen.iter().map(<[_; 2]>::as_slice), &pen);
    }
}

/// End of a line across.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

/// The distance beside an end of a line, where it is in the image and no vehicle is there; true where it is written.
fn number(
    canvas: &mut Canvas,
    view: &View,
    layout: &Layout,
    (end, z): (&Point3<f64>, f64),
    vehicles: &[Rectangle],
    side: Side,
) -> bool {
    let Some([x, y]) = view.point(end) else { return false };
    let size = 0.8 * layout.capital_px;
    let text = format!("{z:.0} m");
    let width = crate::text::width_px(&text, size);
    let start = [if side == Side::Right { x + size } else { x - size - width }, y + 0.5 * size];
    let place = Rectangle::new(start[0], start[1] - size, start[0] + width, start[1]);
    let free = vehicles.iter().all(|v| v.common(&place).is_none());
    let fits = free && view.image().common(&place).is_some_and(|inside| inside == place);
    if fits {
        canvas.text(&text, start, size, WHITE.faded(0.7));
    }
    fits
}
