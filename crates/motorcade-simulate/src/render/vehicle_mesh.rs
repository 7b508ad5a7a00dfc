//! Vehicles as meshes in the unit box: x −½..½ of the length, y −½..½ of the width, z 0..1 of the height.

use motorcade_perception::VehicleClass;
use motorcade_vehicles::Dimensions;
use nalgebra::Point3;

use crate::form::{Form, Glasshouse};
use crate::mesh::{Material, Mesh, Part, Vertex};
use crate::trailer::TrailerKind;
use crate::vehicle::{Body, SimulatedVehicle};

/// A cross-section of a body: x, lowest and highest z, half width (½ at the widest), all as fractions.
pub(super) type Station = [f64; 4];

/// The cab of a truck.
const CAB: [Station; 4] = [
    [0.27, 0.16, 0.84, 0.475],
    [0.43, 0.13, 0.86, 0.485],
    [0.485, 0.12, 0.60, 0.48],
    [0.5, 0.14, 0.42, 0.46],
];
/// Its load.
const CARGO: [Station; 2] = [[-0.5, 0.22, 1.0, 0.50], [0.25, 0.22, 1.0, 0.50]];
/// The cab of a tractor, over its whole height.
const TRACTOR_CAB: [Station; 4] =
    [[0.13, 0.16, 1.0, 0.475], [0.42, 0.13, 1.0, 0.49], [0.485, 0.12, 0.62, 0.49], [0.5, 0.14, 0.40, 0.47]];
/// Its frame.
const TRACTOR_FRAME: [Station; 2] = [[-0.5, 0.15, 0.27, 0.2], [0.13, 0.15, 0.27, 0.2]];
/// The box of a semi-trailer.
const SEMI_TRAILER: [Station; 2] = [[-0.5, 0.28, 1.0, 0.50], [0.5, 0.28, 1.0, 0.50]];
/// The body of a caravan.
const CARAVAN: [Station; 4] =
    [[-0.5, 0.18, 0.94, 0.48], [-0.46, 0.14, 1.0, 0.50], [0.22, 0.14, 1.0, 0.50], [0.31, 0.20, 0.72, 0.48]];
/// Its drawbar.
const DRAWBAR: [Station; 2] = [[0.30, 0.17, 0.22, 0.06], [0.5, 0.17, 0.21, 0.02]];
/// A bus.
const BUS: [Station; 4] =
    [[-0.5, 0.12, 0.96, 0.48], [-0.48, 0.10, 1.0, 0.50], [0.46, 0.10, 1.0, 0.50], [0.5, 0.12, 0.90, 0.47]];
/// A coarse motorcycle with rider.
const MOTORCYCLE: [Station; 5] = [
    [-0.45, 0.20, 0.50, 0.12],
    [-0.15, 0.15, 0.95, 0.38],
    [0.0, 0.15, 1.0, 0.40],
    [0.15, 0.15, 0.80, 0.42],
    [0.45, 0.20, 0.55, 0.15],
];

/// The mesh of a vehicle in its own frame \[m\].
pub(crate) fn mesh(vehicle: &SimulatedVehicle) -> Mesh {
    let mut builder = Builder::new(vehicle.size, vehicle.form());
    match vehicle.body {
        Body::Usual => return build(vehicle.class, &vehicle.size, &vehicle.form()),
        Body::Tractor => {
            builder.loft(&TRACTOR_CAB, Part::Body, 0.95);
            builder.loft(&TRACTOR_FRAME, Part::Trim, 1.0);
            builder.wheels(0.40);
        }
        Body::Trailer { kind: TrailerKind::Semi, .. } => {
            builder.loft(&SEMI_TRAILER, Part::Cargo, 1.0);
            builder.wheels(0.40);
        }
        Body::Trailer { kind: TrailerKind::Caravan, .. } => {
            builder.loft(&CARAVAN, Part::Body, 0.92);
            builder.loft(&DRAWBAR, Part::Trim, 1.0);
            builder.wheels(0.20);
        }
    }
    builder.mesh
}

fn build(class: VehicleClass, size: &Dimensions, form: &Form) -> Mesh {
    let mut builder = Builder::new(*size, *form);
    if let Some(glasshouse) = &form.glasshouse {
        builder.loft(&lower_body(glasshouse, form), Part::Body, 0.88);
        builder.cabin(glasshouse);
        builder.wheels(0.20);
        return builder.mesh;
    }
    match class {
        VehicleClass::Truck => {
            builder.loft(&CAB, Part::Body, 0.95);
            builder.loft(&CARGO, Part::Cargo, 1.0);
            builder.wheels(0.40);
        }
        // Cars and vans have a glasshouse; others are plain boxes.
        VehicleClass::Bus | VehicleClass::Car | VehicleClass::Van => {
            builder.loft(&BUS, Part::Body, 0.95);
            builder.wheels(0.35);
        }
        VehicleClass::Motorcycle => {
            builder.loft(&MOTORCYCLE, Part::Body, 0.5);
            builder.wheels(0.14);
        }
    }
    builder.mesh
}

/// Bumper, boot, flanks and bonnet up to the windows, rear to front.
pub(super) fn lower_body(g: &Glasshouse, form: &Form) -> Vec<Station> {
    let (foot, bonnet_start) = (g.windscreen, 0.5 * (g.windscreen.0 + 0.465));
    let middle = 0.5 * (g.rear_window.1 + foot.1);
    vec![
        [-0.5, 0.24, g.tail - 0.13, 0.36],
        [-0.488, 0.19, g.tail - 0.05, 0.43],
        [-0.470, 0.16, g.tail, 0.465],
        [g.rear_window.0.max(-0.46), 0.15, g.rear_window.1, 0.475],
        [form.rear_axle, 0.13, g.rear_window.1.min(middle + 0.01), 0.498],
        [0.5 * (form.rear_axle + foot.0), 0.13, middle, 0.50],
        [foot.0, 0.13, foot.1, 0.498],
        [bonnet_start, 0.14, 0.5 * (foot.1 + g.bonnet) + 0.012, 0.485],
        [0.465, 0.15, g.bonnet, 0.45],
        [0.487, 0.17, g.bonnet - 0.07, 0.41],
        [0.5, 0.21, g.bonnet - 0.16, 0.34],
    ]
}

pub(super) struct Builder {
    pub(super) mesh: Mesh,
    size: Dimensions,
    form: Form,
}

impl Builder {
    pub(super) fn new(size: Dimensions, form: Form) -> Self {
        Self { mesh: Mesh::default(), size, form }
    }

    /// A vertex at fractions of length, width, height.
    fn at(&self, [x, y, z]: [f64; 3]) -> Vertex {
        let position = Point3::new(x * self.size.length_m, y * self.size.width_m, z * self.size.height_m);
        Vertex { position, attributes: [x, y, z] }
    }

    pub(super) fn face(&mut self, corners: [[f64; 3]; 4], part: Part) {
        let quad = corners.map(|c| self.at(c));
        self.mesh.quad(quad, Material::Skin(part));
    }

    /// Skin over cross-sections; `shoulder` is the width of the top relative to the largest width.
    pub(super) fn loft(&mut self, stations: &[Station], part: Part, shoulder: f64) {
        let ring = |[x, low, high, half]: Station| -> [[f64; 3]; 10] {
            let z = |f: f64| low + (high - low) * f;
            let right = [
                [half * 0.90, low],
                [half * 0.985, z(0.15)],
                [half, z(0.55)],
                [half * 0.97, z(0.90)],
                [half * shoulder, high],
            ];
            std::array::from_fn(|i| {
                let (side, k) = if i < 5 { (1.0, i) } else { (-1.0, 9 - i) };
                [x, side * right[k][0], right[k][1]]
            })
        };
        for pair in stations.windows(2) {
            let (rear, front) = (ring(pair[0]), ring(pair[1]));
            for i in 0..10 {
                let j = (i + 1) % 10;
                self.face([front[i], front[j], rear[j], rear[i]], part);
            }
        }
        for (station, outward) in [(stations.first(), false), (stations.last(), true)] {
            let Some(station) = station else { continue };
            let ring = ring(*station);
            for k in 0..4 {
                // Strips from the left half to the right half close the end.
                let strip = [ring[k], ring[k + 1], ring[8 - k], ring[9 - k]];
                let [a, b, c, d] = strip;
                self.face(if outward { [a, b, c, d] } else { [d, c, b, a] }, part);
            }
        }
    }

    /// Windows and roof.
    fn cabin(&mut self, g: &Glasshouse) {
        let towards = |from: f64, to: f64, share: f64| from + (to - from) * share;
        // A ring is (rear x, rear z, front x, front z, half width).
        let (rear, front) = (g.rear_window, g.windscreen);
        let crown = |inset: f64, z: f64, half: f64| {
            let middle = 0.5 * (g.roof_rear + g.roof_front);
            [towards(g.roof_rear, middle, inset), z, towards(g.roof_front, middle, inset), z, half]
        };
        let rings: [[f64; 5]; 4] = [
            [rear.0, rear.1 - 0.02, front.0, front.1 - 0.02, 0.442],
            crown(0.0, g.roof_corner, 0.345),
            crown(0.08, towards(g.roof_corner, 1.0, 0.75), 0.30),
            crown(0.25, 1.0, 0.20),
        ];
        let corners = |[rear, rear_z, front, front_z, half]: [f64; 5]| {
            [[rear, half, rear_z], [rear, -half, rear_z], [front, -half, front_z], [front, half, front_z]]
        };
        for pair in rings.windows(2) {
            let (low, high) = (corners(pair[0]), corners(pair[1]));
            for i in 0..4 {
                let j = (i + 1) % 4;
                self.face([low[i], low[j], high[j], high[i]], Part::Cabin);
            }
        }
        let [a, b, c, d] = corners(rings[3]);
        self.face([a, b, c, d], Part::Cabin);
    }

    /// Four wheels that stand on the road.
    pub(super) fn wheels(&mut self, width_m: f64) {
        const SIDES: usize = 16;
        let radius = self.form.tyre_radius;
        let outer = 0.485;
        let inner = outer - width_m / self.size.width_m;
        let along = radius * self.size.height_m / self.size.length_m;
        for axle in [self.form.front_axle, self.form.rear_axle] {
            for side in [1.0, -1.0] {
                let rim = |i: usize, share: f64, y: f64| {
                    let angle = i as f64 / SIDES as f64 * std::f64::consts::TAU;
                    [axle + share * along * angle.sin(), side * y, radius * (1.0 - share * angle.cos())]
                };
                for i in 0..SIDES {
                    let wall = [
                        rim(i, 0.62, outer),
                        rim(i + 1, 0.62, outer),
                        rim(i + 1, 1.0, outer),
                        rim(i, 1.0, outer),
                    ];
                    self.face(wall, Part::Tyre);
                    let tread = [
                        rim(i, 1.0, outer),
                        rim(i + 1, 1.0, outer),
                        rim(i + 1, 1.0, inner),
                        rim(i, 1.0, inner),
                    ];
                    self.face(tread, Part::Tyre);
                    let centre = [axle, side * outer, radius];
                    let disc = [rim(i, 0.62, outer), rim(i + 1, 0.62, outer), centre].map(|c| self.at(c));
                    self.mesh.triangle(disc, Material::Skin(Part::Hub));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_class_fills_its_box_and_stands_on_the_road() {
        let size = Dimensions { length_m: 4.2, width_m: 1.8, height_m: 1.5 };
        for class in VehicleClass::ALL {
            let body = crate::form::body_type(class, &size, 0.5);
            let mesh = build(class, &size, &Form::of(class, body, &size));
            let corners: Vec<_> = mesh.triangles.iter().flat_map(|t| t.corners.map(|c| c.position)).collect();
            let range = |f: &dyn Fn(&Point3<f64>) -> f64| {
                corners.iter().map(f).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
            };
            let (low, high) = range(&|p| p.z);
            assert!(low.abs() < 1e-9 && (high - 1.5).abs() < 1e-9, "{class}: {low} {high}");
            let (back, front) = range(&|p| p.x);
            assert!((front - back) / 4.2 > 0.89 && front <= 2.1 + 1e-9 && back >= -2.1 - 1e-9, "{class}");
            let (right, left) = range(&|p| p.y);
            assert!((left + right).abs() < 1e-9 && left <= 0.9 + 1e-9 && left > 0.85, "{class}: {left}");
        }
    }

    #[test]
    fn tractors_and_trailers_fill_their_boxes_and_stand_on_the_road() {
        let scenario = crate::Scenario::by_name("trailers").unwrap();
        let drive = crate::simulate(&scenario, 1, 1, &crate::RenderOptions::default()).unwrap();
        let coupled = drive.vehicles.iter().filter(|v| v.body != Body::Usual);
        for vehicle in coupled.clone() {
            let points: Vec<_> =
                mesh(vehicle).triangles.iter().flat_map(|t| t.corners.map(|c| c.position)).collect();
            let size = vehicle.size;
            for (axis, extent) in [(0, size.length_m), (1, size.width_m), (2, 2.0 * size.height_m)] {
                let most = points.iter().map(|p| p[axis]).fold(f64::MIN, f64::max);
                assert!(
                    (most - 0.5 * extent).abs() < 0.02 * extent,
                    "{:?}, axis {axis}: {most}",
                    vehicle.body
                );
            }
            let lowest = points.iter().map(|p| p.z).fold(f64::MAX, f64::min);
            assert!(lowest.abs() < 1e-9, "{:?}: {lowest}", vehicle.body);
        }
        assert_eq!(coupled.count(), 6);
    }
}
