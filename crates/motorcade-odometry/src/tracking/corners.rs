//! Shi–Tomasi corners, distributed over the image by a grid.

use nalgebra::Point2;

use super::eigenvalues::{EigenvalueMap, HALF_WINDOW};
use super::level::PyramidLevel;
use super::options::CornerOptions;

/// Finds new corners where `occupied` leaves room and `usable(x, y)` allows it. Order: cell by cell, strongest first.
pub fn detect(
    image: &PyramidLevel,
    occupied: &[Point2<f64>],
    usable: impl Fn(usize, usize) -> bool,
    options: &CornerOptions,
) -> Vec<Point2<f64>> {
    // Smaller cells would hold less than two corners at the default distance.
    const LEAST_CELL_PX: usize = 16;
    let (w, h) = (image.width(), image.height());
    let cell = (w / options.columns.max(1)).max(LEAST_CELL_PX);
    let border = options.border_px.max(HALF_WINDOW + 2);
    if w <= 2 * border || h <= 2 * border {
        return Vec::new();
    }
    let map = EigenvalueMap::new(image);
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
    fn finds_the_corners_of_a_square_and_none_beside_existing_ones() {
        let image = GrayImage::from_fn(160, 120, |x, y| {
            Luma([if (50..90).contains(&x) && (40..80).contains(&y) { 200 } else { 40 }])
        });
        let plane = PyramidLevel::from_gray(&image);
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
