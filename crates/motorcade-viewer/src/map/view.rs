//! Scale and extent of the map.

use motorcade::RunResult;
use nalgebra::Vector2;

use crate::axis::{Axis, range};
use crate::outline::position;
use crate::text::points;

/// Width and largest height of the drawing \[px\].
pub(super) const WIDTH_PX: f64 = 1100.0;
const MOST_HEIGHT_PX: f64 = 900.0;
/// Margins for the axis labels \[px\].
const LEFT_PX: f64 = 46.0;
const BOTTOM_PX: f64 = 40.0;
const TOP_PX: f64 = 10.0;
/// Vehicles farther than this from the camera's path do not widen the map \[m\].
const REACH_M: f64 = 100.0;

/// Map from metres on the road to pixels.
pub(super) struct View {
    pub(super) across: Axis,
    pub(super) down: Axis,
    /// True when forward is to the right: drives are longer than wide, and so are screens.
    pub(super) turned: bool,
    pub(super) height_px: f64,
}

impl View {
    /// The view of a run; `None` without poses.
    pub(super) fn of(result: &RunResult, truth: &[[f64; 3]]) -> Option<Self> {
        let camera: Vec<Vector2<f64>> = camera_path(result);
        let truth = truth.iter().map(|p| Vector2::new(p[0], p[2]));
        let paths: Vec<_> = camera.iter().copied().chain(truth).collect();
        let bounds = |k: usize| range(paths.iter().map(|p| p[k]), 0.0, 0.0);
        let (core_x, core_z) = (bounds(0)?, bounds(1)?);
        let near = |p: &Vector2<f64>| within(p.x, core_x, REACH_M) && within(p.y, core_z, REACH_M);
        let vehicles = result.vehicles.iter().flat_map(|v| v.states.iter().map(position)).filter(near);
        let all: Vec<_> = paths.iter().copied().chain(vehicles).collect();
        // Positions are centres; 4 m hold half a vehicle.
        let bounds = |k: usize| range(all.iter().flat_map(|p| [p[k] - 4.0, p[k] + 4.0]), 0.0, 20.0);
        let ([x0, x1], [z0, z1]) = (bounds(0)?, bounds(1)?);
        let turned = z1 - z0 > x1 - x0;
        let (wide, high) = if turned { ([z0, z1], [x0, x1]) } else { ([x0, x1], [z0, z1]) };
        let (room_x, room_y) = (WIDTH_PX - LEFT_PX - 10.0, MOST_HEIGHT_PX - TOP_PX - BOTTOM_PX);
        // A straight drive keeps some height: the numbers on the left need it.
        let high = widened(high, 0.22 * (wide[1] - wide[0]));
        let px_per_m = (room_x / (wide[1] - wide[0])).min(room_y / (high[1] - high[0]));
        // Spare width beside a tall map shows more of the world.
        let spare = 0.5 * (room_x / px_per_m - (wide[1] - wide[0]));
        let wide = [wide[0] - spare, wide[1] + spare];
        let bottom = TOP_PX + px_per_m * (high[1] - high[0]);
        // The camera's right is down on the page when forward is to the right.
        let down = if turned { [TOP_PX, bottom] } else { [bottom, TOP_PX] };
        Some(Self {
            across: Axis { values: wide, pixels: [LEFT_PX, WIDTH_PX - 10.0] },
            down: Axis { values: high, pixels: down },
            turned,
            height_px: bottom + BOTTOM_PX,
        })
    }

    /// Pixel of a position on the road.
    pub(super) fn at(&self, p: &Vector2<f64>) -> (f64, f64) {
        let (wide, high) = if self.turned { (p.y, p.x) } else { (p.x, p.y) };
        (self.across.at(wide), self.down.at(high))
    }

    /// Whether x and z are swapped, and offset and pixels a metre of both directions: what the script needs to draw on the map.
    pub(super) fn linear(&self) -> String {
        let terms = |axis: &Axis| (axis.at(0.0), axis.at(1.0) - axis.at(0.0));
        let ((x, by_x), (y, by_y)) = (terms(&self.across), terms(&self.down));
        format!("{} {x:.3} {by_x:.6} {y:.3} {by_y:.6}", u8::from(self.turned))
    }

    /// Points of an SVG path.
    pub(super) fn path(&self, positions: impl IntoIterator<Item = Vector2<f64>>) -> String {
        points(positions.into_iter().map(|p| self.at(&p)))
    }

    /// x1, y1, x2, y2 of the map itself \[px\].
    pub(super) fn frame(&self) -> [f64; 4] {
        [LEFT_PX, TOP_PX, self.across.pixels[1], self.height_px - BOTTOM_PX]
    }
}

fn within(value: f64, [low, high]: [f64; 2], reach: f64) -> bool {
    value > low - reach && value < high + reach
}

fn widened([low, high]: [f64; 2], least: f64) -> [f64; 2] {
    let more = 0.5 * (least - (high - low)).max(0.0);
    [low - more, high + more]
}

/// Positions of the camera on the road \[m\].
pub(super) fn camera_path(result: &RunResult) -> Vec<Vector2<f64>> {
    result.ego.frames.iter().map(|f| f.world_from_camera.translation().xz()).collect()
}
