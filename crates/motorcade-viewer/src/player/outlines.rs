//! Vehicles of one frame as lines in its picture.

use motorcade::RunResult;
use motorcade_draw::visible_edges;
use serde_json::{Value, json};

/// Index of the vehicle, SVG path of its cuboid and rectangle x, y, width, height around it \[px of the frame\].
pub(super) fn outlines(result: &RunResult, row: usize) -> Vec<Value> {
    let Some(ego) = result.ego.frames.get(row) else { return Vec::new() };
    let camera_from_world = ego.world_from_camera.inverse();
    let mut out = Vec::new();
    for (k, vehicle) in result.vehicles.iter().enumerate() {
        let Ok(at) = vehicle.states.binary_search_by_key(&row, |s| s.frame) else { continue };
        let state = &vehicle.states[at];
        let size = [vehicle.size.length_m, vehicle.size.width_m, vehicle.size.height_m];
        let edges = visible_edges(&result.camera, &(camera_from_world * state.world_from_vehicle), size);
        if !edges.is_empty() {
            let path: String = edges.iter().map(|[a, b]| line(*a, *b)).collect();
            out.push(json!([k, path, around(&edges)]));
        }
    }
    out
}

fn line(a: [f64; 2], b: [f64; 2]) -> String {
    format!("M{:.0} {:.0}L{:.0} {:.0}", a[0], a[1], b[0], b[1])
}

fn around(edges: &[[[f64; 2]; 2]]) -> [f64; 4] {
    let ends = || edges.iter().flatten();
    let bound =
        |k: usize, fold: fn(f64, f64) -> f64, start: f64| ends().map(|p| p[k]).fold(start, fold).round();
    let (x, y) = (bound(0, f64::min, f64::INFINITY), bound(1, f64::min, f64::INFINITY));
    [x, y, bound(0, f64::max, f64::NEG_INFINITY) - x, bound(1, f64::max, f64::NEG_INFINITY) - y]
}
