//! GeoJSON (RFC 7946).

use motorcade_dataset::Geodetic;
use serde_json::{Value, json};

use super::{CAMERA, camera, name, position_sigma_m, vehicle};
use crate::anchor::Placed;

/// A collection with a line a vehicle and one of the camera. Properties: `times` (UTC, where known), seconds of the run, standard
/// deviations \[m\] at every position: of the camera those in the world of the run, of the vehicles likewise; those of the
/// placing itself stand in `anchor`.
pub fn geojson(placed: &Placed<'_>) -> String {
    let run = placed.run;
    let sigma = run.frames.iter().map(position_sigma_m);
    let own = json!({"name": CAMERA, "kind": CAMERA, "sigma_m": sigma.map(round).collect::<Vec<_>>()});
    let mut features = vec![feature(placed, &camera(placed), own)];
    for v in &run.vehicles {
        let sigma = |s: &motorcade::RecordedState| round(s.sigma_m[0].hypot(s.sigma_m[1]));
        let properties = json!({
            "name": name(v),
            "kind": "vehicle",
            "id": v.id,
            "class": v.class,
            "p_moving": v.p_moving,
            "size_m": v.size_m,
            "speed_mps": v.states.iter().map(|s| round(s.speed_mps)).collect::<Vec<_>>(),
            "sigma_m": v.states.iter().map(sigma).collect::<Vec<_>>(),
        });
        features.push(feature(placed, &vehicle(placed, v), properties));
    }
    let a = &placed.anchor;
    let anchor = json!({
        "latitude_deg": a.start.latitude_deg,
        "longitude_deg": a.start.longitude_deg,
        "heading_deg": a.heading_deg,
        "sigma_position_m": a.sigma.map(|(position, _)| position),
        "sigma_heading_deg": a.sigma.map(|(_, heading)| heading),
        "clock_offset_s": a.clock_offset_s,
    });
    json!({"type": "FeatureCollection", "anchor": anchor, "features": features}).to_string()
}

/// A line; a point where there is one position alone.
fn feature(placed: &Placed<'_>, way: &[(i64, Geodetic)], mut properties: Value) -> Value {
    properties["seconds"] = way.iter().map(|(t, _)| round(*t as f64 * 1e-9)).collect();
    if placed.anchor.clock_offset_s.is_some() {
        properties["times"] = way.iter().map(|(t, _)| placed.utc(*t)).collect();
    }
    let geometry = match way {
        [(_, at)] => json!({"type": "Point", "coordinates": position(at)}),
        _ => {
            let line: Vec<_> = way.iter().map(|(_, at)| position(at)).collect();
            json!({"type": "LineString", "coordinates": line})
        }
    };
    json!({"type": "Feature", "geometry": geometry, "properties": properties})
}

/// Longitude, latitude, altitude: to about a centimetre.
pub(super) fn position(at: &Geodetic) -> [f64; 3] {
    let digits = |value: f64, power: f64| (value * power).round() / power;
    [digits(at.longitude_deg, 1e7), digits(at.latitude_deg, 1e7), digits(at.altitude_m, 1e2)]
}

pub(super) fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
