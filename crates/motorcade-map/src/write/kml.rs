//! KML 2.2.

use motorcade_dataset::Geodetic;

use super::xml::Xml;
use super::{CAMERA, camera, name, vehicle};
use crate::anchor::Placed;

/// A line a vehicle and one of the camera, on the ground.
pub fn kml(placed: &Placed<'_>) -> String {
    let mut xml = Xml::new();
    xml.element("kml", &[("xmlns", "http://www.opengis.net/kml/2.2")], |xml| {
        xml.element("Document", &[], |xml| {
            xml.text("name", "motorcade");
            // Colours are written alpha, blue, green, red.
            style(xml, CAMERA, "ffc95712", "4");
            style(xml, "vehicle", "ff0e56b3", "2");
            line(xml, CAMERA, CAMERA, &camera(placed));
            for v in &placed.run.vehicles {
                line(xml, &name(v), "vehicle", &vehicle(placed, v));
            }
        });
    });
    xml.finish()
}

fn style(xml: &mut Xml, id: &str, colour: &str, width: &str) {
    xml.element("Style", &[("id", id)], |xml| {
        xml.element("LineStyle", &[], |xml| {
            xml.text("color", colour);
            xml.text("width", width);
        });
    });
}

fn line(xml: &mut Xml, name: &str, style: &str, way: &[(i64, Geodetic)]) {
    let position =
        |at: &Geodetic| format!("{:.8},{:.8},{:.2}", at.longitude_deg, at.latitude_deg, at.altitude_m);
    let positions: Vec<String> = way.iter().map(|(_, at)| position(at)).collect();
    xml.element("Placemark", &[], |xml| {
        xml.text("name", name);
        xml.text("styleUrl", &format!("#{style}"));
        xml.element("LineString", &[], |xml| {
            xml.text("tessellate", "1");
            xml.text("altitudeMode", "clampToGround");
            xml.text("coordinates", &positions.join(" "));
        });
    });
}
