//! Road pixels of a frame on a coarse grid, kept while the frame serves as the earlier one of an alignment.

use motorcade_geometry::PinholeCamera;
use nalgebra::Point2;

/// Side of a cell \[px\]: the resolution against memory and time.
const CELL_PX: usize = 4;

/// One flag per cell, evaluated at its central pixel; road everywhere before it is filled.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct RoadPixels {
    columns: usize,
    cells: Vec<bool>,
}

impl RoadPixels {
    /// Road everywhere.
    pub fn everywhere() -> &'static Self {
        static EVERYWHERE: RoadPixels = RoadPixels { columns: 0, cells: Vec::new() };
        &EVERYWHERE
    }

    /// Evaluates `usable` for every cell.
    pub fn fill(&mut self, camera: &PinholeCamera, usable: impl Fn(&Point2<f64>) -> bool) {
        let count = |side: u32| (side as usize).div_ceil(CELL_PX);
        let middle = |i: usize| (i * CELL_PX) as f64 + 0.5 * (CELL_PX - 1) as f64;
        self.columns = count(camera.width);
        let rows = count(camera.height);
        self.cells.clear();
        self.cells.extend(
            (0..self.columns * rows)
                .map(|i| usable(&Point2::new(middle(i % self.columns), middle(i / self.columns)))),
        );
    }

    /// True when a pixel may be road, and outside the image, where nothing is compared.
    pub fn contains(&self, p: &Point2<f64>) -> bool {
        let cell = |x: f64| (x + 0.5).max(0.0) as usize / CELL_PX;
        let column = cell(p.x);
        if column >= self.columns {
            return true;
        }
        self.cells.get(cell(p.y) * self.columns + column).copied().unwrap_or(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_evaluated_at_their_central_pixel() {
        let camera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 10.0, cy: 10.0, width: 22, height: 17 };
        let mut pixels = RoadPixels::default();
        pixels.fill(&camera, |p| p.x > 8.0 && p.y > 4.0);
        let contains = |x: f64, y: f64| pixels.contains(&Point2::new(x, y));
        assert!(contains(9.0, 6.0) && contains(21.4, 16.4) && !contains(7.0, 6.0) && !contains(9.0, 3.0));
        assert!(contains(40.0, 3.0) && contains(3.0, 40.0));
    }
}
