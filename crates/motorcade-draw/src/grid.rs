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
/// Lines on each side and distance between two \[m\]: half a lane. A lane on each side of the camera: farther aside is verge on most roads.
const ASIDE: i32 = 2;
const STEP_ASIDE_M: f64 = 1.75;
/// Opacity of the lines, and of every second distance, which has a number.
const FAINT: f64 = 0.34;
const CLEARER: f64 = 0.55;

/// Draws the grid but where something is in front of the road, in these rectangles.
pub(crate) fn draw(
    canvas: &mut Canvas,
    view: &View,
    road: &RoadPlane,
    layout: &Layout,
    hiding: &[Rectangle],
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
            let text = format!("{z:.0} m");
            let size = 0.8 * layout.capital_px;
            let gap = [size, -size - crate::text::width_px(&text, size)];
            // At the left end where the right one is hidden or outside.
            let places = [half_m, -half_m].into_iter().zip(gap);
            let mut starts = places.filter_map(|(x, gap)| {
                let [end_x, end_y] = view.point(&at(z, x))?;
                Some([end_x + gap, end_y + 0.5 * size])
            });
            if let Some(start) = starts.find(|start| is_free(view, *start, (&text, size), hiding)) {
                canvas.text(&text, start, size, WHITE.faded(0.7));
            }
        } else {
            faint.push(line);
        }
    }
    for (lines, opacity) in [(faint, FAINT), (clearer, CLEARER)] {
        let seen: Vec<Segment> = lines.iter().flat_map(|line| outside(line, hiding)).collect();
        let pen = Pen::new(WHITE.faded(opacity), 0.8 * layout.line_px).seamed(0.4 * layout.line_px);
        canvas.lines(seen.iter().map(<[_; 2]>::as_slice), &pen);
    }
}

/// True where a text of this size that starts at `start` is in the image and nothing hides the road there.
fn is_free(view: &View, start: [f64; 2], (text, size): (&str, f64), hiding: &[Rectangle]) -> bool {
    let width = crate::text::width_px(text, size);
    let place = Rectangle::new(start[0], start[1] - size, start[0] + width, start[1]);
    let free = hiding.iter().all(|other| other.common(&place).is_none());
    free && view.image().common(&place).is_some_and(|inside| inside == place)
}
