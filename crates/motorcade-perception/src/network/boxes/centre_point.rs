//! Objects as points: probabilities of box centres `[1, C, h, w]`, sizes `[1, 2, h, w]` (width, height) and offsets of the centre
//! `[1, 2, h, w]` (x, y), sizes and offsets in cells. A cell counts where its probability is the largest of its 3×3 neighbours.

use rten_tensor::Tensor;
use rten_tensor::prelude::*;

use super::{Candidate, Classes, WrongOutput};

pub(super) fn decode(
    outputs: &[Tensor<f32>],
    (height, width): (usize, usize),
    classes: &Classes,
) -> Result<Vec<Candidate>, WrongOutput> {
    let [heat, size, offset, ..] = outputs else {
        return Err(WrongOutput::new(&[outputs.len()], "three outputs: heat map, size, offset"));
    };
    let shape = heat.shape().to_vec();
    let [1, channels, rows, columns] = shape[..] else {
        return Err(WrongOutput::new(&shape, "[1, classes, h, w]"));
    };
    if channels <= classes.last() || rows == 0 || columns == 0 {
        return Err(WrongOutput::new(&shape, format!("[1, {} or more, h, w]", classes.last() + 1)));
    }
    for other in [size, offset] {
        if other.shape() != [1, 2, rows, columns] {
            return Err(WrongOutput::new(other.shape(), format!("[1, 2, {rows}, {columns}]")));
        }
    }
    let (heat, size, offset) = (heat.to_vec(), size.to_vec(), offset.to_vec());
    let cells = rows * columns;
    let stride = [width as f64 / columns as f64, height as f64 / rows as f64];
    let candidate = |cell: usize| {
        let (row, column) = (cell / columns, cell % columns);
        let score = |number: usize| {
            let map = &heat[number * cells..][..cells];
            if is_peak(map, row, column, columns) { f64::from(map[cell]) } else { -1.0 }
        };
        let (score, class) = classes.best(score)?;
        let axis = |k: usize, place: usize| {
            let middle = (place as f64 + f64::from(offset[k * cells + cell])) * stride[k];
            let half = 0.5 * f64::from(size[k * cells + cell]) * stride[k];
            (middle - half, middle + half)
        };
        let ((x1, x2), (y1, y2)) = (axis(0, column), axis(1, row));
        let edges_px = [x1, y1, x2, y2];
        edges_px.iter().all(|edge| edge.is_finite()).then_some(Candidate { class, score, edges_px })
    };
    Ok((0..cells).filter_map(candidate).collect())
}

/// True for a cell that is larger than the neighbours before it and not smaller than those after it.
fn is_peak(map: &[f32], row: usize, column: usize, columns: usize) -> bool {
    let rows = map.len() / columns;
    let cell = row * columns + column;
    let neighbours = (row.saturating_sub(1)..(row + 2).min(rows))
        .flat_map(|r| (column.saturating_sub(1)..(column + 2).min(columns)).map(move |c| r * columns + c));
    neighbours
        .filter(|other| *other != cell)
        .all(|other| if other < cell { map[other] < map[cell] } else { map[other] <= map[cell] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::VehicleClass;

    const ROWS: usize = 4;
    const COLUMNS: usize = 6;

    fn classes() -> Classes {
        Classes { known: vec![(1, VehicleClass::Car)], min_score: 0.3 }
    }

    /// Two classes; the second has a peak at row 2, column 3 with a weaker neighbour.
    fn outputs() -> Vec<Tensor<f32>> {
        let cells = ROWS * COLUMNS;
        let at = 2 * COLUMNS + 3;
        let mut heat = vec![0.0; 2 * cells];
        (heat[at], heat[cells + at], heat[cells + at + 1]) = (0.9, 0.8, 0.7);
        let (mut size, mut offset) = (vec![0.0; 2 * cells], vec![0.0; 2 * cells]);
        (size[at], size[cells + at]) = (2.0, 1.0);
        (offset[at], offset[cells + at]) = (0.5, 0.25);
        let map = |channels: usize, data: Vec<f32>| Tensor::from_data(&[1, channels, ROWS, COLUMNS], data);
        vec![map(2, heat), map(2, size), map(2, offset)]
    }

    #[test]
    fn a_peak_becomes_a_box_in_pixels_of_the_input() {
        // Cells of 10 px along x, 20 px along y.
        let found = decode(&outputs(), (80, 60), &classes()).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0].score - 0.8).abs() < 1e-6);
        let expected = [25.0, 35.0, 45.0, 55.0];
        assert!(found[0].edges_px.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?}");
    }

    #[test]
    fn another_shape_is_refused() {
        let mut wrong = outputs();
        wrong[2] = Tensor::from_data(&[1, 2, 2, 2], vec![0.0; 8]);
        assert_eq!(decode(&wrong, (80, 60), &classes()).unwrap_err().found, [1, 2, 2, 2]);
        assert!(decode(&wrong[..2], (80, 60), &classes()).is_err());
    }
}
