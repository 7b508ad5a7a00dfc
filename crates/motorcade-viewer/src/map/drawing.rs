//! Camera and vehicles on the map.

use motorcade::RunResult;
use motorcade_vehicles::{VehicleState, VehicleTrajectory};

use super::view::{View, camera_path};
use crate::hue::hue;
use crate::outline::{footprint, is_moving, kind, most_certain, position};
use crate::text::{escape, number, px};

/// Path of the camera.
pub(super) fn camera(view: &View, result: &RunResult) -> String {
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

/// Path and outline of a vehicle.
pub(super) fn vehicle(view: &View, vehicle: &VehicleTrajectory, index: usize) -> String {
    let Some(shown) = shown(vehicle) else { return String::new() };
    let moving = is_moving(vehicle);
    let (kind, words) = (kind(vehicle), if moving { "moving" } else { "parked" });
    let mut out = format!(
        "<g class=\"vehicle {kind}\" data-vehicle=\"{id}\" style=\"--h:{}\"><title>{} {id}, {words}, P(moving) {}</title>",
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
pub(super) fn shown(vehicle: &VehicleTrajectory) -> Option<&VehicleState> {
    if is_moving(vehicle) { vehicle.states.last() } else { most_certain(vehicle) }
}
