//! Vehicles in the picture.

use foxglove::messages::points_annotation::Type;
use foxglove::messages::{Color, ImageAnnotations, Point2, PointsAnnotation, TextAnnotation};
use motorcade::RecordedRun;
use motorcade_draw::visible_edges;
use motorcade_geometry::PinholeCamera;

use super::colour;
use super::convert::timestamp;
use crate::label::label;

/// The vehicles of the frame in a row, as their cuboids' edges in the picture.
pub(crate) fn annotations(
    run: &RecordedRun,
    row: usize,
    camera: &PinholeCamera,
    states: &[(usize, usize)],
) -> ImageAnnotations {
    let frame = &run.frames[row];
    let at = Some(timestamp(frame.timestamp_ns));
    let camera_from_world = frame.world_from_camera.inverse();
    let mut out = ImageAnnotations { timestamp: at, ..ImageAnnotations::default() };
    for (v, s) in states {
        let vehicle = &run.vehicles[*v];
        let state = &vehicle.states[*s];
        let edges = visible_edges(camera, &(camera_from_world * state.world_from_vehicle), vehicle.size_m);
        let Some([x, y]) = upper_left(&edges) else { continue };
        let point = |[x, y]: &[f64; 2]| Point2 { x: *x, y: *y };
        out.points.push(PointsAnnotation {
            timestamp: at,
            r#type: Type::LineList.into(),
            points: edges.iter().flatten().map(point).collect(),
            outline_color: Some(colour::of(*v, vehicle, 1.0)),
            thickness: 2.0,
            ..PointsAnnotation::default()
        });
        out.texts.push(TextAnnotation {
            timestamp: at,
            position: Some(Point2 { x, y: y - 4.0 }),
            text: label(vehicle, state),
            font_size: 12.0,
            text_color: Some(Color { r: 1.0, g: 1.0, b: 1.0, a: 1.0 }),
            background_color: Some(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.6 }),
            ..TextAnnotation::default()
        });
    }
    out
}

fn upper_left(edges: &[[[f64; 2]; 2]]) -> Option<[f64; 2]> {
    let ends = edges.iter().flatten();
    ends.copied().reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])])
}
