//! Shi–Tomasi corners, spread over the image by a grid.

use nalgebra::Point2;

use super::pyramid::Plane;

/// Where and how densely corners are sought.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CornerOptions {
    /// Grid columns across the image; cells are square, at least 16 px.
    pub columns: usize,
    /// Corners a cell should hold, those already tracked included.
    pub per_cell: usize,
    /// Least distance between corners \[px\].
    pub distance_px: f64,
    /// Least smaller eigenvalue of the structure tensor, mean over the window \[(grey levels/px)²\]: above sensor noise.
    pub least_eigenvalue: f32,
    /// Corners nearer to the border are not used \[px\].
    pub border_px: usize,
}

impl Default for CornerOptions {
    fn default() -> Self {
        Self { columns: 31, per_cell: 2, distance_px: 10.0, least_eigenvalue: 8.0, border_px: 12 }
    }
}

/// Smaller eigenvalue of the 7×7 structure tensor at every pixel of a band of rows.
struct EigenvalueMap {
    width: usize,
    values: Vec<f32>,
}

const HALF_WINDOW: usize = 3;

impl EigenvalueMap {
    fn new(plane: &Plane) -> Self {
        let (w, h) = (plane.width(), plane.height());
        let mut values = vec![0.0_f32; w * h];
        let rows = 2 * HALF_WINDOW + 1;
        let mut ring: Vec<[Vec<f32>; 3]> = (0..rows).map(|_| [0; 3].map(|_| vec![0.0; w])).collect();
        let mut sums: [Vec<f32>; 3] = [0; 3].map(|_| vec![0.0; w]);
        let inner = w - 2 * HALF_WINDOW;
        let mut totals: [Vec<f32>; 3] = [0; 3].map(|_| vec![0.0; inner]);
        for y in 0..h {
            gradient_products(plane, y, &mut ring[y % rows]);
            if y + 1 < rows {
                continue;
            }
            // Summed anew each row: a running sum in f32 would drift.
            for (k, sum) in sums.iter_mut().enumerate() {
                sum.copy_from_slice(&ring[0][k]);
                for row in &ring[1..] {
                    sum.iter_mut().zip(&row[k]).for_each(|(s, v)| *s += v);
                }
            }
            let out = &mut values[(y - HALF_WINDOW) * w..(y - HALF_WINDOW + 1) * w];
            for (sum, total) in sums.iter().zip(&mut totals) {
                // Column by column of the window, so that neighbouring pixels are summed side by side.
                total.copy_from_slice(&sum[..inner]);
                for k in 1..rows {
                    total.iter_mut().zip(&sum[k..]).for_each(|(t, v)| *t += v);
                }
            }
            for (x, out) in out[HALF_WINDOW..HALF_WINDOW + inner].iter_mut().enumerate() {
                let (xx, xy, yy) = (totals[0][x], totals[1][x], totals[2][x]);
                let (half_trace, half_diff) = (0.5 * (xx + yy), 0.5 * (xx - yy));
                *out = (half_trace - (half_diff * half_diff + xy * xy).sqrt()) / (rows * rows) as f32;
            }
        }
        Self { width: w, values }
    }
    fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }
    fn is_peak(&self, x: usize, y: usize) -> bool {
        let v = self.at(x, y);
        // Strict on one side, so that of a plateau of equal pixels exactly one survives.
        (y - 1..=y + 1).all(|yy| {
            (x - 1..=x + 1).all(|xx| {
                let other = self.at(xx, yy);
                if (yy, xx) < (y, x) { other < v } else { other <= v }
            })
        })
    }
}

/// Products xx, xy, yy of the gradient along a row; zero on the image's rim.
fn gradient_products(plane: &Plane, y: usize, out: &mut [Vec<f32>; 3]) {
    let (w, h) = (plane.width(), plane.height());
    if y == 0 || y + 1 >= h {
        out.iter_mut().for_each(|row| row.fill(0.0));
        return;
    }
    let (up, mid, down) = (plane.row(y - 1), plane.row(y), plane.row(y + 1));
    let [xx, xy, yy] = out;
    for x in 1..w - 1 {
        let (gx, gy) = (0.5 * (mid[x + 1] - mid[x - 1]), 0.5 * (down[x] - up[x]));
        (xx[x], xy[x], yy[x]) = (gx * gx, gx * gy, gy * gy);
    }
}

/// Finds new corners where `occupied` leaves room and `usable(x, y)` allows it. Order: cell by cell, strongest first.
pub fn detect(
    plane: &Plane,
    occupied: &[Point2<f64>],
    usable: impl Fn(usize, usize) -> bool,
    options: &CornerOptions,
) -> Vec<Point2<f64>> {
    const LEAST_CELL_PX: usize = 16;
    let (w, h) = (plane.width(), plane.height());
    let cell = (w / options.columns.max(1)).max(LEAST_CELL_PX);
    let border = options.border_px.max(HALF_WINDOW + 2);
    if w <= 2 * border || h <= 2 * border {
        return Vec::new();
    }
    let map = EigenvalueMap::new(plane);
    let (columns, rows) = (w.div_ceil(cell), h.div_ceil(cell));
    let mut taken: Vec<Vec<Point2<f64>>> = vec![Vec::new(); columns * rows];
    let cell_of = |p: &Point2<f64>| {
        let clamp = |v: f64, n: usize| ((v.max(0.0) as usize) / cell).min(n - 1);
        (clamp(p.x, columns), clamp(p.y, rows))
    };
    for p in occupied {
        let (c, r) = cell_of(p);
        taken[r * columns + c].push(*p);
    }
    let mut found = Vec::new();
    let mut candidates: Vec<(f32, usize, usize)> = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            if taken[r * columns + c].len() >= options.per_cell {
                continue;
            }
            candidates.clear();
            for y in (r * cell).max(border)..((r + 1) * cell).min(h - border) {
                for x in (c * cell).max(border)..((c + 1) * cell).min(w - border) {
                    let v = map.at(x, y);
                    if v >= options.least_eigenvalue && usable(x, y) && map.is_peak(x, y) {
                        candidates.push((v, x, y));
                    }
                }
            }
            candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
            for (_, x, y) in &candidates {
                if taken[r * columns + c].len() >= options.per_cell {
                    break;
                }
                let p = Point2::new(*x as f64, *y as f64);
                let near =
                    |q: &Point2<f64>| (q - p).norm_squared() < options.distance_px * options.distance_px;
                let neighbours = (r.saturating_sub(1)..=(r + 1).min(rows - 1)).flat_map(|rr| {
                    (c.saturating_sub(1)..=(c + 1).min(columns - 1)).map(move |cc| rr * columns + cc)
                });
                if !neighbours.flat_map(|i| &taken[i]).any(near) {
                    taken[r * columns + c].push(p);
                    found.push(p);
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    #[test]
    fn finds_the_corners_of_a_square_and_respects_what_is_there() {
        let image = GrayImage::from_fn(160, 120, |x, y| {
            Luma([if (50..90).contains(&x) && (40..80).contains(&y) { 200 } else { 40 }])
        });
        let plane = Plane::from_gray(&image);
        let options = CornerOptions::default();
        let found = detect(&plane, &[], |_, _| true, &options);
        for corner in [(50.0, 40.0), (89.0, 40.0), (50.0, 79.0), (89.0, 79.0)] {
            let near = found.iter().any(|p| (p - Point2::new(corner.0, corner.1)).norm() < 3.0);
            assert!(near, "no corner near {corner:?} in {found:?}");
        }
        assert!(detect(&plane, &found, |_, _| true, &options).is_empty());
        assert!(detect(&plane, &[], |_, _| false, &options).is_empty());
    }
}
