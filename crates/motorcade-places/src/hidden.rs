//! Parts of a picture that show no place.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Cells along the width of a picture: a car 30 m ahead is some cells wide at a focal length of 0.6 widths, and a picture takes 200 bytes.
const COLUMNS: u32 = 64;

/// Parts of a picture from which no features are taken, vehicles and what is fixed to the camera, in square cells. Landmarks behind them cannot be seen
/// again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HiddenParts {
    /// Side of a cell \[px\].
    pub cell_px: f32,
    /// Cells along the width.
    pub columns: u32,
    /// A bit a cell, row by row from the top left, set where the middle of the cell is hidden. Empty where nothing is.
    pub cells: Vec<u64>,
}

impl HiddenParts {
    /// Of a picture of this size where `usable(x, y)` forbids features (pixels).
    pub fn of((width, height): (u32, u32), usable: impl Fn(f64, f64) -> bool) -> Self {
        let cell_px = f64::from(width.max(1)) / f64::from(COLUMNS);
        let rows = (f64::from(height) / cell_px).ceil() as u32;
        let mut cells = vec![0u64; (COLUMNS * rows).div_ceil(u64::BITS) as usize];
        let middle = |cell: u32| (f64::from(cell) + 0.5) * cell_px - 0.5;
        for cell in 0..COLUMNS * rows {
            if !usable(middle(cell % COLUMNS), middle(cell / COLUMNS)) {
                cells[(cell / u64::BITS) as usize] |= 1 << (cell % u64::BITS);
            }
        }
        if cells.iter().all(|word| *word == 0) {
            return Self::default();
        }
        Self { cell_px: cell_px as f32, columns: COLUMNS, cells }
    }

    /// True of a pixel in a hidden cell.
    pub fn hides(&self, pixel: &Point2<f64>) -> bool {
        let cell = |at: f64| ((at + 0.5) / f64::from(self.cell_px)).floor();
        let (column, row) = (cell(pixel.x), cell(pixel.y));
        if self.cells.is_empty() || !(0.0..f64::from(self.columns)).contains(&column) || row < 0.0 {
            return false;
        }
        let cell = row as usize * self.columns as usize + column as usize;
        let word = self.cells.get(cell / u64::BITS as usize);
        word.is_some_and(|word| word >> (cell % u64::BITS as usize) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hidden_is_told_within_half_a_cell() {
        let usable = |x: f64, y: f64| !((300.0..500.0).contains(&x) && y > 200.0);
        let hidden = HiddenParts::of((1242, 375), usable);
        let hides = |x: f64, y: f64| hidden.hides(&Point2::new(x, y));
        assert!(hides(311.0, 374.0) && hides(489.0, 211.0) && hides(400.0, 300.0));
        assert!(
            !hides(289.0, 300.0) && !hides(511.0, 300.0) && !hides(400.0, 189.0) && !hides(1241.0, 374.0)
        );
        // Beside the picture nothing is.
        assert!(
            !hides(-1.0, 300.0) && !hides(1300.0, 300.0) && !hides(400.0, 2000.0) && !hides(f64::NAN, 3.0)
        );
        assert_eq!(HiddenParts::of((1242, 375), |_, _| true), HiddenParts::default());
        assert!(!HiddenParts::default().hides(&Point2::new(3.0, 3.0)));
        assert_eq!(HiddenParts::of((0, 0), |_, _| false), HiddenParts::default());
    }
}
