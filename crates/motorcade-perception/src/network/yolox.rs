//! YOLOX heads to vehicles.

use image::RgbImage;
use motorcade_dataset::Frame;
use rten_tensor::prelude::*;

use super::engine::Network;
use super::nms::suppress;
use super::preprocess::{input, scale};
use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::detectors::VehicleDetector;
use crate::error::Result;

const STRIDES: [usize; 3] = [8, 16, 32];

/// A YOLOX network that finds vehicles.
#[derive(Debug)]
pub struct YoloxDetector {
    network: Network,
    /// Class number of the network and what it is.
    classes: Vec<(usize, VehicleClass)>,
    min_score: f64,
}

impl VehicleDetector for YoloxDetector {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.detect_in(&frame.rgb())
    }
    fn description(&self) -> String {
        self.network.description()
    }
}

/// One cell of the grid: where it stands and how far cells are apart \[px of the input\].
struct Cell {
    x: f64,
    y: f64,
    stride: f64,
}

impl YoloxDetector {
    pub(crate) fn new(network: Network, classes: Vec<(usize, VehicleClass)>, min_score: f64) -> Self {
        Self { network, classes, min_score }
    }

    /// Finds vehicles, best first.
    pub fn detect_in(&self, image: &RgbImage) -> Result<Vec<Detection>> {
        let size = self.network.size;
        let output = self.network.run(input(&self.network.spec, image, size))?;
        let cells = cells(size);
        let shape = output.shape().to_vec();
        let last_class = self.classes.iter().map(|(class, _)| *class).max().unwrap_or(0);
        let [1, count, width] = shape[..] else {
            return Err(self.network.wrong_output(&shape, "[1, N, 5 + classes]"));
        };
        if count != cells.len() || width < 6 + last_class {
            let expected = format!("[1, {}, {} or more]", cells.len(), 6 + last_class);
            return Err(self.network.wrong_output(&shape, &expected));
        }
        let values = output.to_vec();
        let back = scale(&self.network.spec, image.dimensions(), size);
        let mut found = Vec::new();
        for (row, cell) in values.chunks_exact(width).zip(&cells) {
            let Some((score, class)) = self.best(row) else { continue };
            let [x1, y1, x2, y2] = decode(row, cell);
            // Pixel edges of the input to pixel centres of the image.
            let bbox = [x1 * back.x, y1 * back.y, x2 * back.x, y2 * back.y].map(|edge| edge - 0.5);
            let bbox = BoundingBox::new(bbox).clipped(image.width(), image.height());
            if bbox.width() >= 2.0 && bbox.height() >= 2.0 {
                found.push(Detection {
                    class,
                    score,
                    bbox,
                    convention: BoxConvention::VisibleExtent,
                    external_id: None,
                });
            }
        }
        Ok(suppress(found))
    }

    /// The best vehicle class of a row, when good enough.
    fn best(&self, row: &[f32]) -> Option<(f64, VehicleClass)> {
        let objectness = f64::from(row[4]);
        // Class probabilities are at most 1: most rows end here.
        if objectness < self.min_score {
            return None;
        }
        let scored = self.classes.iter().map(|(class, kind)| (objectness * f64::from(row[5 + class]), *kind));
        scored.filter(|(score, _)| *score >= self.min_score).max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Cells of all strides, finest first, row by row.
fn cells((height, width): (usize, usize)) -> Vec<Cell> {
    let mut cells = Vec::new();
    for stride in STRIDES {
        for y in 0..height / stride {
            for x in 0..width / stride {
                cells.push(Cell { x: x as f64, y: y as f64, stride: stride as f64 });
            }
        }
    }
    cells
}

/// x1, y1, x2, y2 in pixels of the input (Ge et al., *YOLOX*, arXiv 2107.08430).
fn decode(row: &[f32], cell: &Cell) -> [f64; 4] {
    let centre_x = (f64::from(row[0]) + cell.x) * cell.stride;
    let centre_y = (f64::from(row[1]) + cell.y) * cell.stride;
    let half_width = 0.5 * f64::from(row[2]).exp() * cell.stride;
    let half_height = 0.5 * f64::from(row[3]).exp() * cell.stride;
    [centre_x - half_width, centre_y - half_height, centre_x + half_width, centre_y + half_height]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_order_and_box_decoding() {
        let cells = cells((64, 96));
        assert_eq!(cells.len(), 12 * 8 + 6 * 4 + 3 * 2);
        let cell = &cells[12 * 8 + 6 + 2];
        assert_eq!((cell.x, cell.y, cell.stride), (2.0, 1.0, 16.0));
        let row = [0.5, 0.25, 2.0_f32.ln(), 0.0];
        let [x1, y1, x2, y2] = decode(&row, cell);
        let expected = [24.0, 12.0, 56.0, 28.0];
        assert!([x1, y1, x2, y2].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5));
    }
}
