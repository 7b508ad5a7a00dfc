//! The way of a kept map of places as GeoJSON.

use motorcade::PlaceMap;
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};

use super::geojson::{position, round};
use crate::anchor::Anchor;

/// The world of a map is its first camera, which stands about level: right, forward and up of it.
const LEVEL: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];

/// A line for each part of the way between whose keyframes the poses belong together, with the rows of the frames.
pub fn places_geojson(map: &PlaceMap, anchor: &Anchor) -> String {
    let level = Matrix3::from_fn(|r, c| LEVEL[r][c]);
    let enu_from_world = anchor.turn() * level;
    let place = |at: &Vector3<f64>| position(&anchor.start.moved(&(enu_from_world * at)));
    let features: Vec<Value> = map
        .keyframes
        .chunk_by(|a, b| a.segment == b.segment)
        .map(|part| {
            let line: Vec<_> = part.iter().map(|k| place(&k.world_from_camera.translation())).collect();
            let geometry = match line.as_slice() {
                [only] => json!({"type": "Point", "coordinates": only}),
                _ => json!({"type": "LineString", "coordinates": line}),
            };
            let properties = json!({
                "kind": "way",
                "map": part.first().map(|k| k.segment),
                "rows": part.iter().map(|k| k.frame).collect::<Vec<_>>(),
                "way_m": part.iter().map(|k| round(k.way_m)).collect::<Vec<_>>(),
                "landmarks": part.iter().map(|k| k.landmarks.len()).collect::<Vec<_>>(),
            });
            json!({"type": "Feature", "geometry": geometry, "properties": properties})
        })
        .collect();
    json!({"type": "FeatureCollection", "features": features}).to_string()
}
