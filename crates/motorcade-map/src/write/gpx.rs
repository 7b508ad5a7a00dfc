//! GPX 1.1.

use motorcade_dataset::Geodetic;

use super::xml::Xml;
use super::{CAMERA, camera, name, vehicle};
use crate::anchor::Placed;

/// A track a vehicle and one of the camera, with times where they are known.
pub fn gpx(placed: &Placed<'_>) -> String {
    let mut xml = Xml::new();
    let root = [
        ("version", "1.1"),
        ("creator", concat!("motorcade ", env!("CARGO_PKG_VERSION"))),
        ("xmlns", "http://www.topografix.com/GPX/1/1"),
    ];
    xml.element("gpx", &root, |xml| {
        track(xml, placed, CAMERA, &camera(placed));
        for v in &placed.run.vehicles {
            track(xml, placed, &name(v), &vehicle(placed, v));
        }
    });
    xml.finish()
}

fn track(xml: &mut Xml, placed: &Placed<'_>, name: &str, way: &[(i64, Geodetic)]) {
    xml.element("trk", &[], |xml| {
        xml.text("name", name);
        xml.element("trkseg", &[], |xml| {
            for (time_ns, at) in way {
                let (lat, lon) = (format!("{:.8}", at.latitude_deg), format!("{:.8}", at.longitude_deg));
                xml.element("trkpt", &[("lat", &lat), ("lon", &lon)], |xml| {
                    xml.text("ele", &format!("{:.2}", at.altitude_m));
                    if let Some(utc) = placed.utc(*time_ns) {
                        xml.text("time", &utc);
                    }
                });
            }
        });
    });
}
