//! Meshes of vehicles with varied appearance: rounder bodies, mirrors, roof rails, spoilers, signs.

use super::look::VehicleLook;
use super::vehicle_mesh::{self, Builder, Station};
use crate::form::Glasshouse;
use crate::mesh::{Mesh, Part};
use crate::vehicle::SimulatedVehicle;

/// Steps between two stations of a body.
const STEPS: usize = 2;

/// The mesh of a vehicle in its own frame \[m\].
pub(super) fn mesh(vehicle: &SimulatedVehicle, look: &VehicleLook) -> Mesh {
    let form = vehicle.form();
    let Some(glasshouse) = form.glasshouse else { return vehicle_mesh::mesh(vehicle) };
    let mut builder = Builder::new(vehicle.size, form);
    let stations = vehicle_mesh::lower_body(&glasshouse, &form);
    builder.loft(&smooth(&stations), Part::Body, 0.88);
    cabin(&mut builder, &glasshouse, vehicle.roof_half());
    builder.wheels(0.20);
    fittings(&mut builder, &glasshouse, look, vehicle.roof_half());
    builder.mesh
}

/// Stations between the stations, on a Catmull–Rom curve through them.
fn smooth(stations: &[Station]) -> Vec<Station> {
    let at = |i: isize| stations[(i.max(0) as usize).min(stations.len() - 1)];
    let mut out = Vec::with_capacity(STEPS * stations.len());
    for i in 0..stations.len() as isize - 1 {
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        for step in 0..STEPS {
            let t = step as f64 / STEPS as f64;
            out.push(std::array::from_fn(|k| {
                let tangent = |p: Station, q: Station, s: f64| {
                    // Stations are not evenly spaced: slopes are by x.
                    if k == 0 || (q[0] - p[0]).abs() < 1e-9 { 0.0 } else { (q[k] - p[k]) / (q[0] - p[0]) * s }
                };
                if k == 0 {
                    return b[0] + (c[0] - b[0]) * t;
                }
                let span = c[0] - b[0];
                let (m0, m1) = (0.6 * tangent(a, c, span), 0.6 * tangent(b, d, span));
                let (t2, t3) = (t * t, t * t * t);
                (2.0 * t3 - 3.0 * t2 + 1.0) * b[k]
                    + (t3 - 2.0 * t2 + t) * m0
                    + (3.0 * t2 - 2.0 * t3) * c[k]
                    + (t3 - t2) * m1
            }));
        }
    }
    out.extend(stations.last());
    out
}

/// Windows and roof, with a crown in both directions.
fn cabin(builder: &mut Builder, g: &Glasshouse, roof_half: f64) {
    let (rear, front) = (g.rear_window, g.windscreen);
    let middle = 0.5 * (g.roof_rear + g.roof_front);
    let towards = |from: f64, to: f64, share: f64| from + (to - from) * share;
    // A ring is (rear x, rear z, front x, front z, half width at the ends, half width in the middle).
    let crown = |inset: f64, z: f64, half: f64| {
        [towards(g.roof_rear, middle, inset), z, towards(g.roof_front, middle, inset), z, half]
    };
    let belt = [rear.0, rear.1 - 0.02, front.0, front.1 - 0.02, 0.442];
    let roof = crown(0.0, g.roof_corner, roof_half);
    let half_way: [f64; 5] = std::array::from_fn(|k| towards(belt[k], roof[k], 0.5));
    // Pillars bulge slightly: the glasshouse is no prism.
    let bulged = [half_way[0] - 0.004, half_way[1], half_way[2] + 0.006, half_way[3], half_way[4] + 0.008];
    let rings = [
        belt,
        bulged,
        roof,
        crown(0.06, towards(g.roof_corner, 1.0, 0.65), 0.9 * roof_half),
        crown(0.2, towards(g.roof_corner, 1.0, 0.93), 0.7 * roof_half),
        crown(0.42, 1.0, 0.4 * roof_half),
    ];
    // Twelve corners: screens and sides are curved in plan.
    let corners = |[rear, rear_z, front, front_z, half]: [f64; 5]| -> [[f64; 3]; 12] {
        let bow = 0.012;
        let (quarter, length) = (0.5 * half, front - rear);
        [
            [rear, half, rear_z],
            [rear - bow, quarter, rear_z],
            [rear - bow, -quarter, rear_z],
            [rear, -half, rear_z],
            [rear + 0.3 * length, -half - 0.004, towards(rear_z, front_z, 0.3)],
            [front - 0.3 * length, -half - 0.004, towards(rear_z, front_z, 0.7)],
            [front, -half, front_z],
            [front + bow, -quarter, front_z],
            [front + bow, quarter, front_z],
            [front, half, front_z],
            [front - 0.3 * length, half + 0.004, towards(rear_z, front_z, 0.7)],
            [rear + 0.3 * length, half + 0.004, towards(rear_z, front_z, 0.3)],
        ]
    };
    for pair in rings.windows(2) {
        let (low, high) = (corners(pair[0]), corners(pair[1]));
        for i in 0..12 {
            let j = (i + 1) % 12;
            builder.face([low[i], low[j], high[j], high[i]], Part::Cabin);
        }
    }
    let top = corners(rings[5]);
    for k in 0..5 {
        // Strips across close the roof; the last one is a triangle.
        let strip = [top[k], top[k + 1], top[(10 - k).min(11)], top[11 - k]];
        builder.face(strip, Part::Cabin);
    }
}

fn fittings(builder: &mut Builder, g: &Glasshouse, look: &VehicleLook, roof_half: f64) {
    if look.mirrors {
        let (x, z) = (g.windscreen.0 - 0.085, g.windscreen.1 + 0.05);
        for side in [1.0, -1.0] {
            block(
                builder,
                [x - 0.018, x + 0.022],
                [side * 0.46, side * 0.56],
                [z - 0.05, z + 0.045],
                Part::Trim,
            );
        }
    }
    if look.rails {
        for side in [1.0, -1.0] {
            let y = side * (roof_half - 0.03);
            block(
                builder,
                [g.roof_rear + 0.02, g.roof_front - 0.04],
                [y - 0.012, y + 0.012],
                [g.roof_corner, (g.roof_corner + 0.055).min(1.03)],
                Part::Trim,
            );
        }
    }
    if look.spoiler {
        let z = g.roof_corner;
        block(
            builder,
            [g.roof_rear - 0.02, g.roof_rear + 0.04],
            [-0.9 * roof_half, 0.9 * roof_half],
            [z - 0.01, z + 0.02],
            Part::Body,
        );
    }
    if look.sign > 0.0 {
        let x = 0.5 * (g.roof_rear + g.roof_front);
        let (half, high) = (f64::from(look.sign) * 2.6, 1.0 + f64::from(look.sign));
        block(builder, [x - 0.03, x + 0.03], [-half, half], [0.985, high], Part::Hub);
    }
}

/// An upright block between two corners.
fn block(builder: &mut Builder, x: [f64; 2], y: [f64; 2], z: [f64; 2], part: Part) {
    let (y0, y1) = (y[0].min(y[1]), y[0].max(y[1]));
    let ([x0, x1], [z0, z1]) = (x, z);
    let floor = |z: f64| [[x1, y1, z], [x0, y1, z], [x0, y0, z], [x1, y0, z]];
    let (low, high) = (floor(z0), floor(z1));
    for i in 0..4 {
        let j = (i + 1) % 4;
        builder.face([low[i], low[j], high[j], high[i]], part);
    }
    builder.face(high, part);
    let [a, b, c, d] = low;
    builder.face([d, c, b, a], part);
}
