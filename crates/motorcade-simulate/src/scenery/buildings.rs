//! Houses.

use nalgebra::{Point2, Point3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::mesh::{Building, Chunk, Material, Mesh, Vertex};
use crate::motion::{Road, axes};

/// A rectangle beside the road.
pub(super) struct Plot {
    /// Middle along the road \[m\].
    pub s: f64,
    /// +1 left, −1 right.
    pub side: f64,
    /// Distance of the front wall from the centre line \[m\].
    pub front_m: f64,
    pub width_m: f64,
    pub depth_m: f64,
    /// Begin of the façade's pattern \[m\].
    pub windows_m: f64,
}

impl Plot {
    /// Front left, front right, back right, back left as seen from the road, level.
    fn corners(&self, road: &Road) -> [Point2<f64>; 4] {
        let centre = road.at(self.s);
        let (forward, left) = axes(centre.heading_rad);
        let out = left * self.side;
        // From the road, left is ahead on the left side and behind on the right.
        let along = -forward * self.side * 0.5 * self.width_m;
        let front = centre.position.xy() + out * self.front_m;
        let back = front + out * self.depth_m;
        [front + along, front - along, back - along, back + along]
    }
    /// Corners and points between them, to test against obstacles.
    pub(super) fn outline(&self, road: &Road) -> Vec<Point2<f64>> {
        let c = self.corners(road);
        let between = |i: usize| nalgebra::center(&c[i], &c[(i + 1) % 4]);
        c.iter().copied().chain((0..4).map(between)).collect()
    }
}

const WALLS: [[f32; 3]; 8] = [
    [0.78, 0.72, 0.60],
    [0.72, 0.70, 0.66],
    [0.62, 0.40, 0.30],
    [0.80, 0.78, 0.74],
    [0.66, 0.56, 0.44],
    [0.52, 0.32, 0.26],
    [0.74, 0.64, 0.50],
    [0.58, 0.60, 0.60],
];
const ROOFS: [[f32; 3]; 4] = [[0.46, 0.24, 0.18], [0.30, 0.28, 0.28], [0.38, 0.22, 0.18], [0.24, 0.25, 0.28]];

/// Builds a house with a pitched or flat roof and adds its appearance.
pub(super) fn house(road: &Road, plot: &Plot, seed: u64, looks: &mut Vec<Building>) -> Option<Chunk> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let wall = rng.random_range(0..WALLS.len());
    let storeys = rng.random_range(2..5);
    let storey_m: f32 = rng.random_range(2.7..3.3);
    let height_m = 1.6 + storeys as f32 * storey_m + 0.4;
    let pitch_m = [rng.random_range(1.9..3.2), storey_m];
    let window_m = [pitch_m[0] * rng.random_range(0.38..0.6), storey_m * rng.random_range(0.42..0.58)];
    let index = looks.len() as u32;
    looks.push(Building {
        wall: WALLS[wall],
        roof: ROOFS[rng.random_range(0..ROOFS.len())],
        height_m,
        pitch_m,
        window_m,
        brick: matches!(wall, 2 | 5),
        seed,
    });
    let base = road.at(plot.s).position.z;
    let corners = plot.corners(road);
    let mut mesh = Mesh::default();
    let top = f64::from(height_m);
    let at = |p: &Point2<f64>, up: f64| Point3::new(p.x, p.y, base + up);
    let vertex = |position: Point3<f64>, u: f64, v: f64| Vertex { position, attributes: [u, v, 0.0] };
    let mut along = plot.windows_m;
    for i in 0..4 {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        let end = along + (b - a).norm();
        // Walls start below the ground: the road may climb along the house.
        let quad = [
            vertex(at(&a, -2.5), along, -2.5),
            vertex(at(&b, -2.5), end, -2.5),
            vertex(at(&b, top), end, top),
            vertex(at(&a, top), along, top),
        ];
        mesh.quad(quad, Material::Facade(index));
        along = end;
    }
    roof(&mut mesh, &corners.map(|c| at(&c, top)), rng.random_bool(0.7), index);
    Chunk::around(mesh)
}

fn roof(mesh: &mut Mesh, eaves: &[Point3<f64>; 4], pitched: bool, index: u32) {
    let vertex = |position: Point3<f64>, u: f64, v: f64| Vertex { position, attributes: [u, v, 0.0] };
    let [a, b, c, d] = *eaves;
    let (width, depth) = ((b - a).norm(), (d - a).norm());
    if !pitched {
        let quad =
            [vertex(a, 0.0, 0.0), vertex(b, width, 0.0), vertex(c, width, depth), vertex(d, 0.0, depth)];
        mesh.quad(quad, Material::Roof(index));
        return;
    }
    let up = nalgebra::Vector3::new(0.0, 0.0, 0.32 * depth);
    let (left, right) = (nalgebra::center(&a, &d) + up, nalgebra::center(&b, &c) + up);
    let slope = (left - nalgebra::center(&a, &a)).norm();
    let front =
        [vertex(a, 0.0, 0.0), vertex(b, width, 0.0), vertex(right, width, slope), vertex(left, 0.0, slope)];
    let back =
        [vertex(c, 0.0, 0.0), vertex(d, width, 0.0), vertex(left, width, slope), vertex(right, 0.0, slope)];
    mesh.quad(front, Material::Roof(index));
    mesh.quad(back, Material::Roof(index));
    for (p, q, ridge) in [(d, a, left), (b, c, right)] {
        // Gables continue the wall above the last row of windows.
        let gable =
            [vertex(p, 0.0, 400.0), vertex(q, depth, 400.0), vertex(ridge, 0.5 * depth, 400.0 + up.z)];
        mesh.triangle(gable, Material::Roof(index));
    }
}
