//! Rasterisation of triangles into quarter pixels.

use std::ops::Range;

use motorcade_geometry::PinholeCamera;
use nalgebra::{Point3, Vector3};

use crate::mesh::{Triangle, Vertex};

/// Depth of the near plane \[m\].
const NEAR_M: f64 = 0.25;
/// No surface: the sky.
pub(super) const NOTHING: u32 = u32::MAX;

/// A linear function of the pixel: a x + b y + c.
pub(super) type Linear = [f64; 3];

/// A triangle in the image.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    /// Its rows, in pixels; the last one not included.
    pub rows: (i32, i32),
    /// Its columns, likewise.
    pub columns: (i32, i32),
    /// Inside where all three are ≥ 0.
    edges: [Linear; 3],
    /// Inverse depth.
    pub inverse_depth: Linear,
    /// Attributes times inverse depth.
    pub attributes: [Linear; 3],
    /// The surface, as index into the frame's list.
    pub surface: u32,
}

#[inline]
pub(super) fn value(f: &Linear, x: f64, y: f64) -> f64 {
    f[0] * x + f[1] * y + f[2]
}

/// A corner in camera coordinates.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub point: Point3<f64>,
    pub attributes: [f64; 3],
}

/// Projects a triangle; one that reaches behind the camera is clipped into up to two pieces.
pub(super) fn project(
    camera: &PinholeCamera,
    triangle: &Triangle,
    to_camera: impl Fn(&Vertex) -> Point3<f64>,
    surface: u32,
    drawn: &mut Vec<Drawn>,
) {
    let corner = |v: &Vertex| Corner { point: to_camera(v), attributes: v.attributes };
    let corners = triangle.corners.map(|v| corner(&v));
    let in_front = corners.iter().filter(|c| c.point.z >= NEAR_M).count();
    if in_front == 0 {
        return;
    }
    if in_front == 3 {
        drawn.extend(setup(camera, &corners, surface));
        return;
    }
    let mut kept: Vec<Corner> = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        if a.point.z >= NEAR_M {
            kept.push(a);
        }
        if (a.point.z >= NEAR_M) != (b.point.z >= NEAR_M) {
            let t = (NEAR_M - a.point.z) / (b.point.z - a.point.z);
            let attributes =
                std::array::from_fn(|k| a.attributes[k] + (b.attributes[k] - a.attributes[k]) * t);
            kept.push(Corner { point: a.point + (b.point - a.point) * t, attributes });
        }
    }
    for i in 2..kept.len() {
        drawn.extend(setup(camera, &[kept[0], kept[i - 1], kept[i]], surface));
    }
}

fn setup(camera: &PinholeCamera, corners: &[Corner; 3], surface: u32) -> Option<Drawn> {
    let pixel = |c: &Corner| {
        let iz = 1.0 / c.point.z;
        (camera.fx * c.point.x * iz + camera.cx, camera.fy * c.point.y * iz + camera.cy)
    };
    let p = [pixel(&corners[0]), pixel(&corners[1]), pixel(&corners[2])];
    let (min_x, max_x) = (p[0].0.min(p[1].0).min(p[2].0), p[0].0.max(p[1].0).max(p[2].0));
    let (min_y, max_y) = (p[0].1.min(p[1].1).min(p[2].1), p[0].1.max(p[1].1).max(p[2].1));
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    if max_x < -0.5 || min_x > width - 0.5 || max_y < -0.5 || min_y > height - 0.5 {
        return None;
    }
    let area = (p[1].0 - p[0].0) * (p[2].1 - p[0].1) - (p[2].0 - p[0].0) * (p[1].1 - p[0].1);
    if area.abs() < 1e-9 {
        return None;
    }
    let sign = area.signum();
    // The same two corners in reverse order give exactly the negated line, so that neighbours leave no gap.
    let edge = |i: usize, j: usize| {
        let ((xa, ya), (xb, yb)) = (p[i], p[j]);
        [sign * (ya - yb), sign * (xb - xa), sign * (xa * yb - xb * ya)]
    };
    let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
    let through = |values: [f64; 3]| -> Linear {
        let scale = 1.0 / area.abs();
        std::array::from_fn(|k| {
            (values[0] * edges[0][k] + values[1] * edges[1][k] + values[2] * edges[2][k]) * scale
        })
    };
    let inverse = corners.map(|c| 1.0 / c.point.z);
    Some(Drawn {
        rows: ((min_y - 0.5).floor().max(0.0) as i32, (max_y + 1.5).ceil().min(height) as i32),
        columns: ((min_x - 0.5).floor().max(0.0) as i32, (max_x + 1.5).ceil().min(width) as i32),
        edges,
        inverse_depth: through(inverse),
        attributes: std::array::from_fn(|k| {
            through(std::array::from_fn(|i| corners[i].attributes[k] * inverse[i]))
        }),
        surface,
    })
}

impl Drawn {
    /// Covered columns, of the quarter-pixel columns from `first` to `end`, in the quarter-pixel row at image height `y`.
    pub(super) fn span(&self, y: f64, (first, end): (i32, i32)) -> (i32, i32) {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for [a, b, c] in &self.edges {
            let rest = b * y + c;
            if *a > 0.0 {
                low = low.max(-rest / a);
            } else if *a < 0.0 {
                high = high.min(-rest / a);
            } else if rest < 0.0 {
                return (0, 0);
            }
        }
        // Column k has its centre at k / 2 - 1/4.
        let (first, end) = (f64::from(first), f64::from(end));
        let from = (2.0 * low + 0.5).ceil().clamp(first, end);
        let to = ((2.0 * high + 0.5).floor() + 1.0).clamp(first, end);
        (from as i32, to as i32)
    }
}

/// Quarter pixels of some rows of the image.
pub(super) struct Band {
    /// First quarter-pixel column.
    first_column: usize,
    /// Quarter-pixel columns.
    pub columns: usize,
    /// First image row.
    pub row: usize,
    pub inverse_depth: Vec<f32>,
    /// Index of the drawn triangle.
    pub drawn: Vec<u32>,
}

impl Band {
    /// Of these columns of the image and so many rows from `row` on.
    pub(super) fn new(columns: Range<usize>, row: usize, rows: usize) -> Self {
        let samples = 4 * columns.len() * rows;
        Self {
            first_column: 2 * columns.start,
            columns: 2 * columns.len(),
            row,
            inverse_depth: vec![0.0; samples],
            drawn: vec![NOTHING; samples],
        }
    }

    /// Depth test: keeps the nearest surface.
    pub(super) fn draw(&mut self, index: u32, triangle: &Drawn) {
        let rows = self.drawn.len() / self.columns;
        let first = (2 * (triangle.rows.0 - self.row as i32)).max(0) as usize;
        let last = (2 * (triangle.rows.1 - self.row as i32)).clamp(0, rows as i32) as usize;
        for r in first..last {
            let y = self.row as f64 + 0.5 * r as f64 - 0.25;
            let sides = (self.first_column as i32, (self.first_column + self.columns) as i32);
            let (from, to) = triangle.span(y, sides);
            if from >= to {
                continue;
            }
            let step = 0.5 * triangle.inverse_depth[0];
            let start = value(&triangle.inverse_depth, 0.5 * f64::from(from) - 0.25, y);
            let place = |column: i32| r * self.columns + column as usize - self.first_column;
            let span = place(from)..place(to);
            let (Some(depths), Some(shown)) =
                (self.inverse_depth.get_mut(span.clone()), self.drawn.get_mut(span))
            else {
                continue;
            };
            // Both are always written: without a branch the loop is vectorised.
            for (i, (depth, drawn)) in depths.iter_mut().zip(shown).enumerate() {
                let inverse = (start + step * f64::from(i as u32 as i32)) as f32;
                let nearer = inverse > *depth;
                *depth = if nearer { inverse } else { *depth };
                *drawn = if nearer { index } else { *drawn };
            }
        }
    }
}

/// Flips a normal towards the camera.
pub(super) fn facing(normal: &Vector3<f64>, towards_camera: &Vector3<f64>) -> Vector3<f64> {
    if normal.dot(towards_camera) < 0.0 { -normal } else { *normal }
}
