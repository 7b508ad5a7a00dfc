//! SSD with its detection-output layer: `[1, 1, N, 7]`, a row a box: image, class, score, and left, top, right, bottom in
//! shares of the input's width and height. A negative image number ends the rows.

use rten_tensor::Tensor;
use rten_tensor::prelude::*;

use super::{Candidate, Classes, WrongOutput};

const COLUMNS: usize = 7;

pub(super) fn decode(
    outputs: &[Tensor<f32>],
    (height, width): (usize, usize),
    classes: &Classes,
) -> Result<Vec<Candidate>, WrongOutput> {
    let Some(output) = outputs.first() else { return Err(WrongOutput::new(&[], "one output")) };
    let shape = output.shape();
    if shape.last() != Some(&COLUMNS) || shape.iter().rev().skip(2).any(|n| *n != 1) {
        return Err(WrongOutput::new(shape, "[1, 1, N, 7]"));
    }
    let values = output.to_vec();
    let [height, width] = [height as f64, width as f64];
    let candidate = |row: &[f32]| {
        let number = f64::from(row[1]);
        let (score, class) = classes
            .best(|known| if (number - known as f64).abs() < 0.5 { f64::from(row[2]) } else { -1.0 })?;
        let [x1, y1, x2, y2] = [row[3], row[4], row[5], row[6]].map(f64::from);
        let edges_px = [x1 * width, y1 * height, x2 * width, y2 * height];
        edges_px.iter().all(|edge| edge.is_finite()).then_some(Candidate { class, score, edges_px })
    };
    Ok(values.chunks_exact(COLUMNS).take_while(|row| row[0] >= 0.0).filter_map(candidate).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::VehicleClass;

    fn classes() -> Classes {
        Classes { known: vec![(2, VehicleClass::Car), (5, VehicleClass::Bus)], min_score: 0.3 }
    }

    fn output(rows: &[[f32; COLUMNS]]) -> Tensor<f32> {
        Tensor::from_data(&[1, 1, rows.len(), COLUMNS], rows.concat())
    }

    #[test]
    fn rows_of_vehicles_are_scaled_to_the_input() {
        let rows = [
            [0.0, 2.0, 0.9, 0.1, 0.2, 0.3, 0.4],
            [0.0, 1.0, 0.9, 0.1, 0.2, 0.3, 0.4], // another class
            [0.0, 5.0, 0.2, 0.1, 0.2, 0.3, 0.4], // too uncertain
            [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 2.0, 0.9, 0.1, 0.2, 0.3, 0.4], // after the end
        ];
        let found = decode(&[output(&rows)], (200, 400), &classes()).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].class, VehicleClass::Car);
        let expected = [40.0, 40.0, 120.0, 80.0];
        assert!(found[0].edges_px.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn another_shape_is_refused() {
        let other = Tensor::from_data(&[1, 3, 6], vec![0.0; 18]);
        assert_eq!(decode(&[other], (200, 400), &classes()).unwrap_err().found, [1, 3, 6]);
        assert!(decode(&[], (200, 400), &classes()).is_err());
    }
}
