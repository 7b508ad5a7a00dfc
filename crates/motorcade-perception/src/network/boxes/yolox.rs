//! YOLOX: `[1, N, 5 + C]` over strides 8, 16, 32, not decoded: box, objectness, class probabilities.

use rten_tensor::Tensor;
use rten_tensor::prelude::*;

use super::{Candidate, Classes, WrongOutput};

const STRIDES: [usize; 3] = [8, 16, 32];

/// One cell of the grid: its place and the distance between cells \[px of the input\].
struct Cell {
    x: f64,
    y: f64,
    stride: f64,
}

pub(super) fn decode(
    outputs: &[Tensor<f32>],
    size: (usize, usize),
    classes: &Classes,
) -> Result<Vec<Candidate>, WrongOutput> {
    let cells = cells(size);
    let Some(output) = outputs.first() else { return Err(WrongOutput::new(&[], "one output")) };
    let shape = output.shape().to_vec();
    let [1, count, width] = shape[..] else {
        return Err(WrongOutput::new(&shape, "[1, N, 5 + classes]"));
    };
    if count != cells.len() || width < 6 + classes.last() {
        let expected = format!("[1, {}, {} or more]", cells.len(), 6 + classes.last());
        return Err(WrongOutput::new(&shape, expected));
    }
    let values = output.to_vec();
    let candidate = |(row, cell): (&[f32], &Cell)| {
        let objectness = f64::from(row[4]);
        // Class probabilities are at most 1: most rows end here.
        if objectness < classes.min_score {
            return None;
        }
        let (score, class) = classes.best(|number| objectness * f64::from(row[5 + number]))?;
        Some(Candidate { class, score, edges_px: edges_px(row, cell) })
    };
    Ok(values.chunks_exact(width).zip(&cells).filter_map(candidate).collect())
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

/// x1, y1, x2, y2 in pixels of the input.
fn edges_px(row: &[f32], cell: &Cell) -> [f64; 4] {
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
        let [x1, y1, x2, y2] = edges_px(&row, cell);
        let expected = [24.0, 12.0, 56.0, 28.0];
        assert!([x1, y1, x2, y2].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5));
    }
}
