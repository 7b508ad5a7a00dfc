//! One-to-one assignment with the largest sum of weights.

use pathfinding::matrix::Matrix;
use pathfinding::prelude::kuhn_munkres;

/// Step in which weights are compared: the solver takes whole numbers.
const STEP: f64 = 1e-12;

/// Column of each row in the one-to-one assignment with the largest sum of weights (rows × columns, at most 10⁵ each); `None` for rows that are left
/// over or whose weight is zero.
pub(crate) fn best_assignment(weights: &[Vec<f64>]) -> Vec<Option<usize>> {
    let (rows, columns) = (weights.len(), weights.first().map_or(0, Vec::len));
    let mut found = vec![None; rows];
    if columns == 0 {
        return found;
    }
    // The solver wants at most as many rows as columns.
    let wide = rows <= columns;
    let (short, long) = if wide { (rows, columns) } else { (columns, rows) };
    let weight = |(a, b): (usize, usize)| if wide { weights[a][b] } else { weights[b][a] };
    let steps = Matrix::from_fn(short, long, |at| (weight(at) / STEP).round() as i64);
    let (_, partners) = kuhn_munkres(&steps);
    for (a, b) in partners.into_iter().enumerate().filter(|(a, b)| steps[(*a, *b)] > 0) {
        let (row, column) = if wide { (a, b) } else { (b, a) };
        found[row] = Some(column);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_counts_and_not_the_largest_pair() {
        let weights = [vec![0.9, 0.8], vec![0.8, 0.0]];
        assert_eq!(best_assignment(&weights), [Some(1), Some(0)]);
        // More rows than columns, and a pair without weight.
        assert_eq!(best_assignment(&[vec![0.2], vec![0.7], vec![0.1]]), [None, Some(0), None]);
        assert_eq!(best_assignment(&[vec![0.0, 0.5], vec![0.0, 0.6]]), [None, Some(1)]);
        assert_eq!(best_assignment(&[vec![], vec![]]), [None, None]);
        assert!(best_assignment(&[]).is_empty());
    }
}
