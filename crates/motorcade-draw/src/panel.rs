//! The panel beside the image: the map from above, the state of the camera, the legend.

use crate::canvas::{Canvas, Pen};
use crate::colour::{Colour, WHITE};
use crate::label::kmh;
use crate::layout::Layout;
use crate::map;
use crate::scene::Scene;
use crate::segment::{Pixel, Rectangle};
use crate::text::width_px;

const BACKGROUND: Colour = Colour { red: 22, green: 25, blue: 30, opacity: 1.0 };
/// For a camera that was not tracked.
const WARNING: Colour = Colour { red: 255, green: 176, blue: 72, opacity: 1.0 };

/// Draws the panel.
pub(crate) fn draw(canvas: &mut Canvas, scene: &Scene, layout: &Layout) {
    let panel = layout.panel;
    canvas.rectangle(&panel, BACKGROUND);
    let capital = layout.capital_px;
    let (left, pitch) = (panel.x1 + capital, 1.75 * capital);
    // From the bottom up: legend, frame and status, time, speed.
    let legend_y = panel.y2 - capital;
    legend(canvas, [left, legend_y], layout);
    let small = 0.85 * capital;
    let frame = format!("frame {}   {:.2} s", scene.number, scene.time_s);
    canvas.plain_text(&frame, [left, legend_y - pitch], small, WHITE.faded(0.8));
    if let Some(status) = &scene.status {
        let start = [left + width_px(&frame, small) + capital, legend_y - pitch];
        canvas.plain_text(status, start, small, WARNING);
    }
    let speed_y = legend_y - 2.2 * pitch;
    canvas.plain_text(&speed(scene), [left, speed_y], 1.3 * capital, WHITE);
    let top = speed_y - 2.2 * capital;
    map::draw(canvas, scene, Rectangle::new(panel.x1 + 2.0, panel.y1 + 2.0, panel.x2 - 2.0, top), layout);
}

/// Speed of the camera in km/h with its standard deviation.
fn speed(scene: &Scene) -> String {
    match scene.speed_sigma_mps {
        Some(sigma) if sigma.is_finite() => {
            format!("{:.1} ±{:.1} km/h", 3.6 * scene.speed_mps, 3.6 * sigma)
        }
        _ => kmh(scene.speed_mps),
    }
}

/// Moving, parked, and what the ellipses are.
fn legend(canvas: &mut Canvas, [mut x, y]: Pixel, layout: &Layout) {
    let (size, line) = (0.7 * layout.capital_px, layout.line_px);
    let ink = WHITE.faded(0.7);
    for (word, dash) in [("moving", None), ("parked", Some([3.0 * line, 2.0 * line]))] {
        let width = width_px(word, size);
        canvas.plain_text(word, [x, y], size, ink);
        let under = [[x, y + 0.8 * size], [x + width, y + 0.8 * size]];
        canvas.lines([under.as_slice()], &Pen::new(WHITE, 1.3 * line).dashed(dash));
        x += width + 1.5 * size;
    }
    canvas.ellipse([x + size, y - 0.5 * size], [size, 0.6 * size], 0.0, &Pen::new(ink, line));
    canvas.plain_text("2σ", [x + 2.6 * size, y], size, ink);
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::RoadPlane;

    #[test]
    fn the_speed_has_its_deviation_where_it_is_known() {
        let mut scene = Scene {
            number: 1,
            time_s: 0.1,
            status: None,
            speed_mps: 10.0,
            speed_sigma_mps: Some(0.1),
            road: RoadPlane::level(1.5),
            vehicles: Vec::new(),
        };
        assert_eq!(speed(&scene), "36.0 ±0.4 km/h");
        scene.speed_sigma_mps = None;
        assert_eq!(speed(&scene), "36 km/h");
    }
}
