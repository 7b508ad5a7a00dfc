//! Trajectories in the top view, to scale.

use motorcade::RunResult;
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::Vector2;

use crate::axis::{Axis, range};
use crate::hue::hue;
use crate::outline::{footprint, is_moving, most_certain, position};
use crate::placement::Placement;
use crate::text::{escape, number, points, px};

/// Width and largest height of the drawing \[px\].
const WIDTH_PX: f64 = 1100.0;
const MOST_HEIGHT_PX: f64 = 900.0;
/// Margins for the axis labels \[px\].
const LEFT_PX: f64 = 46.0;
const BOTTOM_PX: f64 = 40.0;
const TOP_PX: f64 = 10.0;
/// Vehicles farther than this from the camera's path do not widen the map \[m\].
const REACH_M: f64 = 60.0;

/// Map from metres on the road to pixels.
struct View {
    across: Axis,
    down: Axis,
    /// True when forward is to the right: drives are longer than wide, and so are screens.
    turned: bool,
    height_px: f64,
}

impl View {
    fn of(result: &RunResult, truth: &[[f64; 3]]) -> Option<Self> {
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

    fn at(&self, p: &Vector2<f64>) -> (f64, f64) {
        let (wide, high) = if self.turned { (p.y, p.x) } else { (p.x, p.y) };
        (self.across.at(wide), self.down.at(high))
    }

    fn path(&self, positions: impl IntoIterator<Item = Vector2<f64>>) -> String {
        points(positions.into_iter().map(|p| self.at(&p)))
    }

    /// x1, y1, x2, y2 of the map itself \[px\].
    fn frame(&self) -> [f64; 4] {
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

fn camera_path(result: &RunResult) -> Vec<Vector2<f64>> {
    result.ego.frames.iter().map(|f| f.world_from_camera.translation().xz()).collect()
}

/// The map as SVG; `truth` is the true path of the camera in the world of the run \[m\], empty when unknown.
pub(crate) fn map(result: &RunResult, truth: &[[f64; 3]]) -> String {
    let Some(view) = View::of(result, truth) else {
        return "<p>No frame has a pose.</p>".to_owned();
    };
    let [x1, y1, x2, y2] = view.frame();
    let (w, h) = (px(x2 - x1), px(y2 - y1));
    let mut out = format!(
        "<svg class=\"map\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Trajectories, top view\">\
         <defs><clipPath id=\"map-clip\"><rect x=\"{x1}\" y=\"{y1}\" width=\"{w}\" height=\"{h}\"/></clipPath></defs>\n",
        px(WIDTH_PX),
        px(view.height_px)
    );
    out += &grid(&view);
    out += "<g clip-path=\"url(#map-clip)\">\n";
    if !truth.is_empty() {
        let path = view.path(truth.iter().map(|p| Vector2::new(p[0], p[2])));
        out +=
            &format!("<polyline class=\"truth\" points=\"{path}\"><title>ground truth</title></polyline>\n");
    }
    for (k, vehicle) in result.vehicles.iter().enumerate() {
        out += &drawn(&view, vehicle, k);
    }
    out += &camera(&view, result);
    // Labels last, on top.
    out += &labels(&view, &result.vehicles);
    out + "</g></svg>\n" + &legend(!truth.is_empty())
}

fn grid(view: &View) -> String {
    let [x1, y1, x2, y2] = view.frame();
    // Square cells: both directions take the step of the longer one.
    let span = view.across.values[1] - view.across.values[0];
    let step = crate::axis::round_step(span / 14.0);
    let count = |axis: &Axis| (axis.values[1] - axis.values[0]) / step;
    let mut out = String::new();
    for value in view.across.marks(count(&view.across)).0 {
        let (x, label) = (px(view.across.at(value)), number(value, 0));
        out += &format!("<line class=\"grid\" x1=\"{x}\" y1=\"{y1}\" x2=\"{x}\" y2=\"{}\"/>", px(y2));
        out += &format!(
            "<text class=\"tick\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{label}</text>\n",
            px(y2 + 15.0)
        );
    }
    for value in view.down.marks(count(&view.down)).0 {
        let (y, label) = (px(view.down.at(value)), number(value, 0));
        out += &format!("<line class=\"grid\" x1=\"{x1}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\"/>", px(x2));
        out += &format!(
            "<text class=\"tick\" x=\"{}\" y=\"{y}\" dy=\"4\" text-anchor=\"end\">{label}</text>\n",
            px(x1 - 6.0)
        );
    }
    let (wide, high) =
        if view.turned { ("z, forward [m]", "x, right [m]") } else { ("x, right [m]", "z, forward [m]") };
    let (x, y) = (px(0.5 * (x1 + x2)), px(0.5 * (y1 + y2)));
    out += &format!(
        "<text class=\"axis\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{wide}</text>",
        px(y2 + 32.0)
    );
    out += &format!(
        "<text class=\"axis\" transform=\"translate(12 {y}) rotate(-90)\" text-anchor=\"middle\">{high}</text>\n"
    );
    out + &format!(
        "<rect class=\"frame\" x=\"{x1}\" y=\"{y1}\" width=\"{}\" height=\"{}\"/>\n",
        px(x2 - x1),
        px(y2 - y1)
    )
}

fn camera(view: &View, result: &RunResult) -> String {
    let path = camera_path(result);
    let mut out = format!(
        "<g class=\"camera\"><title>camera, {} m</title><polyline class=\"path\" points=\"{}\"/>",
        number(result.ego.length_m(), 1),
        view.path(path.iter().copied())
    );
    if let (Some(first), Some(last)) = (path.first(), path.last()) {
        out += &marks(view.at(first), view.at(last));
    }
    out + "</g>\n"
}

/// A ring at the start, a disc at the end.
fn marks(start: (f64, f64), end: (f64, f64)) -> String {
    let circle = |class: &str, (x, y): (f64, f64)| {
        format!("<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"5\"/>", px(x), px(y))
    };
    circle("start", start) + &circle("end", end)
}

fn drawn(view: &View, vehicle: &VehicleTrajectory, index: usize) -> String {
    let Some(shown) = shown(vehicle) else { return String::new() };
    let moving = is_moving(vehicle);
    let kind = if moving { "moving" } else { "parked" };
    let mut out = format!(
        "<g class=\"vehicle {kind}\" data-vehicle=\"{id}\" style=\"--h:{}\"><title>{} {id}, {kind}, P(moving) {}</title>",
        hue(index),
        escape(vehicle.class.name()),
        number(vehicle.p_moving, 2),
        id = vehicle.id,
    );
    if moving {
        out += &format!(
            "<polyline class=\"path\" points=\"{}\"/>",
            view.path(vehicle.states.iter().map(position))
        );
    }
    let [a, b, c, d, front] = footprint(vehicle, shown);
    let (middle, front) = (view.at(&position(shown)), view.at(&front));
    out += &format!("<polygon class=\"body\" points=\"{}\"/>", view.path([a, b, c, d]));
    out += &format!(
        "<line class=\"nose\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
        px(middle.0),
        px(middle.1),
        px(front.0),
        px(front.1)
    );
    if let (true, Some(first)) = (moving, vehicle.states.first()) {
        out += &marks(view.at(&position(first)), middle);
    }
    out + "</g>\n"
}

/// The state whose outline is drawn: the last one of a moving vehicle, the most certain one of a parked vehicle.
fn shown(vehicle: &VehicleTrajectory) -> Option<&VehicleState> {
    if is_moving(vehicle) { vehicle.states.last() } else { most_certain(vehicle) }
}

/// Identities beside the outlines, where there is room; all are in the tooltips.
fn labels(view: &View, vehicles: &[VehicleTrajectory]) -> String {
    let mut placement = Placement::new(view.frame());
    let outlines: Vec<_> = vehicles
        .iter()
        .enumerate()
        .filter_map(|(k, vehicle)| {
            let corners = footprint(vehicle, shown(vehicle)?).map(|corner| view.at(&corner));
            Some((k, vehicle, bounds(&corners)))
        })
        .collect();
    for (.., outline) in &outlines {
        placement.occupy(*outline);
    }
    let mut out = String::new();
    for (k, vehicle, outline) in outlines {
        let label = vehicle.id.to_string();
        // Twelve pixel letters are some seven wide.
        let Some((x, y)) = placement.beside(outline, (7.0 * label.len() as f64 + 2.0, 11.0)) else {
            continue;
        };
        let kind = if is_moving(vehicle) { "moving" } else { "parked" };
        out += &format!(
            "<g class=\"vehicle {kind}\" data-vehicle=\"{label}\" style=\"--h:{}\"><text class=\"label\" x=\"{}\" y=\"{}\">{label}</text></g>\n",
            hue(k),
            px(x),
            px(y)
        );
    }
    out
}

/// Bounding rectangle x1, y1, x2, y2 of points.
fn bounds(points: &[(f64, f64)]) -> [f64; 4] {
    let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    points.iter().fold(start, |b, p| [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)])
}

fn legend(truth: bool) -> String {
    let item = |drawing: &str, text: &str| {
        format!(
            "<span class=\"key\"><svg viewBox=\"0 0 34 14\" width=\"34\" height=\"14\">{drawing}</svg>{text}</span>"
        )
    };
    let line = |class: &str| {
        format!("<g class=\"{class}\"><line class=\"path\" x1=\"2\" y1=\"7\" x2=\"32\" y2=\"7\"/></g>")
    };
    let mut out = "<p class=\"legend\">".to_owned();
    out += &item(&line("camera"), "camera");
    if truth {
        out += &item("<line class=\"truth\" x1=\"2\" y1=\"7\" x2=\"32\" y2=\"7\"/>", "camera, ground truth");
    }
    out += &item(&line("vehicle moving"), "moving vehicle, with its id");
    let body =
        "<g class=\"vehicle parked\"><rect class=\"body\" x=\"5\" y=\"2\" width=\"24\" height=\"10\"/></g>";
    out += &item(body, "parked vehicle, to size; the line points forward");
    out += &item("<g class=\"camera\"><circle class=\"start\" cx=\"17\" cy=\"7\" r=\"5\"/></g>", "start");
    out += &item("<g class=\"camera\"><circle class=\"end\" cx=\"17\" cy=\"7\" r=\"5\"/></g>", "end");
    out += "</p>\n<p class=\"legend toggles\">Show:";
    let toggle = |name: &str, text: &str| {
        format!(
            "<label class=\"toggle\"><input type=\"checkbox\" checked data-toggle=\"{name}\"> {text}</label>"
        )
    };
    out += &toggle("moving", "moving");
    out += &toggle("parked", "parked");
    out += &toggle("label", "labels");
    out + "</p>\n"
}
