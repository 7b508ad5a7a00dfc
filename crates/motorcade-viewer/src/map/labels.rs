//! Labels of vehicles on the map.

use motorcade_vehicles::VehicleTrajectory;

use super::drawing::shown;
use super::view::View;
use crate::hue::hue;
use crate::outline::{footprint, kind};
use crate::placement::Placement;
use crate::text::px;

/// Identities beside the outlines, where there is room; all are in the tooltips.
pub(super) fn labels(view: &View, vehicles: &[VehicleTrajectory]) -> String {
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
        let kind = kind(vehicle);
        // Beside the middle, by as much on the screen at every zoom.
        let middle = (0.5 * (outline[0] + outline[2]), 0.5 * (outline[1] + outline[3]));
        out += &format!(
            "<g class=\"vehicle {kind}\" data-vehicle=\"{label}\" style=\"--h:{}\"><text class=\"label\" x=\"{}\" y=\"{}\" style=\"--dx:{};--dy:{}\">{label}</text></g>\n",
            hue(k),
            px(middle.0),
            px(middle.1),
            px(x - middle.0),
            px(y - middle.1)
        );
    }
    out
}

/// Bounding rectangle x1, y1, x2, y2 of points.
fn bounds(points: &[(f64, f64)]) -> [f64; 4] {
    let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    points.iter().fold(start, |b, p| [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)])
}
