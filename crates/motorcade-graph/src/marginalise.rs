//! Marginalisation: variables are replaced by a prior on their neighbours.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::GraphError;
use crate::factor::Normal;
use crate::factors::LinearPrior;
use crate::graph::Graph;
use crate::ids::FactorId;
use crate::ids::VariableId;
use crate::manifold::{Manifold, Value};

/// Removes `variables` and replaces all factors on them by one dense [`LinearPrior`] on their neighbours: the Schur
/// complement of the linearised factors at the current values. Returns that prior's id, `None` when
/// there is no information on the neighbours. The cost depends on the neighbourhood alone.
pub fn marginalise(graph: &mut Graph, variables: &[VariableId]) -> Result<Option<FactorId>, GraphError> {
    let mut gone = variables.to_vec();
    gone.sort_unstable();
    gone.dedup();
    for &id in &gone {
        graph.values().value(id)?;
    }
    let factors = graph.take_factors_of(&gone);
    let mut touched: Vec<VariableId> = factors.iter().flat_map(|f| f.factor.variables()).copied().collect();
    touched.sort_unstable();
    touched.dedup();
    touched.retain(|id| !graph.is_fixed(*id));
    // Free variables to go first, then those that stay. What no factor touches goes without a trace.
    let (mut order, kept): (Vec<_>, Vec<_>) =
        touched.into_iter().partition(|id| gone.binary_search(id).is_ok());
    order.extend(&kept);
    let mut places = Vec::with_capacity(order.len());
    let mut n = 0;
    for &id in &order {
        places.push((id, n));
        n += graph.values().value(id)?.dof();
    }
    let split = places.get(order.len() - kept.len()).map_or(n, |p| p.1);
    places.sort_unstable();
    let place = |id: VariableId| places.binary_search_by_key(&id, |p| p.0).ok().map(|k| places[k].1);

    let (mut h, mut g) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut normal = Normal::default();
    for entry in &factors {
        let factor = &entry.factor;
        let mut blocks = Vec::new();
        let mut size = 0;
        for &id in factor.variables() {
            let dof = graph.values().value(id)?.dof();
            blocks.push((place(id), size, dof));
            size += dof;
        }
        normal.resize(size);
        let s = factor.normal_equations(graph.values(), &mut normal)?;
        let weight = graph.loss_at(entry, s).weight;
        for (k, &(row, from_row, rows)) in blocks.iter().enumerate() {
            let Some(row) = row else { continue };
            for i in 0..rows {
                g[row + i] += weight * normal.g()[from_row + i];
            }
            for &(column, from_column, columns) in &blocks[..=k] {
                let Some(column) = column else { continue };
                for j in 0..columns {
                    for i in 0..rows {
                        let x = weight * normal.h()[(from_column + j) * size + from_row + i];
                        if column != row {
                            h[(row + i, column + j)] += x;
                            h[(column + j, row + i)] += x;
                        } else if i >= j {
                            h[(row + i, column + j)] += x;
                            h[(column + j, row + i)] = h[(row + i, column + j)];
                        }
                    }
                }
            }
        }
    }
    let values: Vec<Value> =
        kept.iter().map(|&id| graph.values().value(id).cloned()).collect::<Result<_, GraphError>>()?;
    for &id in &gone {
        graph.discard(id)?;
    }
    if n == split || factors.is_empty() {
        return Ok(None);
    }
    let (information, gradient) = schur(&h, &g, split);
    // Λ m = g turns the quadratic into a complete square; where Λ is singular the gradient vanishes too.
    let offset = match well_conditioned(&information) {
        Some(factor) => factor.solve(&gradient),
        None => pseudo_inverse(&information) * gradient,
    };
    graph.add_factor(LinearPrior::new(kept, values, offset, information)?).map(Some)
}

/// Schur complement of the first `split` unknowns, for matrix and gradient.
fn schur(h: &DMatrix<f64>, g: &DVector<f64>, split: usize) -> (DMatrix<f64>, DVector<f64>) {
    let keep = h.nrows() - split;
    let hmm = h.view((0, 0), (split, split)).into_owned();
    let hkm = h.view((split, 0), (keep, split)).into_owned();
    let mut right = DMatrix::zeros(split, keep + 1);
    right.view_mut((0, 0), (split, keep)).copy_from(&hkm.transpose());
    right.column_mut(keep).copy_from(&g.rows(0, split));
    let solved = match well_conditioned(&hmm) {
        Some(factor) => factor.solve(&right),
        None => pseudo_inverse(&hmm) * right,
    };
    let lambda = h.view((split, split), (keep, keep)) - &hkm * solved.columns(0, keep);
    let gradient = g.rows(split, keep) - &hkm * solved.column(keep);
    ((&lambda + lambda.transpose()) * 0.5, gradient)
}

/// Smallest over largest eigenvalue below which a direction counts as unknown.
const SINGULAR: f64 = 1e-12;

/// The Cholesky factor; `None` for a matrix that its pivots show to be nearly singular.
fn well_conditioned(m: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let factor = m.clone().cholesky()?;
    let pivots = factor.l_dirty().diagonal();
    (m.is_empty() || pivots.min().powi(2) > SINGULAR * pivots.max().powi(2)).then_some(factor)
}

/// Inverse on the range of a symmetric positive semidefinite matrix. Its zero rows are left out: with a hundred of them the decomposition of nalgebra 0.35
/// may be NaN.
fn pseudo_inverse(m: &DMatrix<f64>) -> DMatrix<f64> {
    let known: Vec<usize> = (0..m.nrows()).filter(|&k| m[(k, k)] > 0.0).collect();
    let mut eigen = m.select_rows(&known).select_columns(&known).symmetric_eigen();
    let limit = SINGULAR * eigen.eigenvalues.amax();
    eigen.eigenvalues.apply(|x| *x = if *x > limit { 1.0 / *x } else { 0.0 });
    let inverse = eigen.recompose();
    let mut all = DMatrix::zeros(m.nrows(), m.ncols());
    for (i, &row) in known.iter().enumerate() {
        for (j, &column) in known.iter().enumerate() {
            all[(row, column)] = inverse[(i, j)];
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use rand::seq::SliceRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// A track that has ended: of its poses without measurements nothing is known, of two the past is.
    fn singular(random: &mut ChaCha8Rng, known: usize, zeros: usize) -> DMatrix<f64> {
        let half = DMatrix::from_fn(known, known - 1, |_, _| random.random_range(-1.0..1.0));
        let mut places: Vec<usize> = (0..known + zeros).collect();
        places.shuffle(random);
        let mut all = DMatrix::zeros(known + zeros, known + zeros);
        for (i, row) in (&half * half.transpose()).row_iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                all[(places[i], places[j])] = 1e3 * x;
            }
        }
        all
    }

    #[test]
    fn a_singular_matrix_with_many_zero_rows_has_an_inverse_on_its_range() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..200 {
            let m = singular(&mut random, 14, 132);
            let inverse = pseudo_inverse(&m);
            assert!((&m * inverse * &m - &m).amax() < 1e-7 * m.amax());
        }
    }
}
