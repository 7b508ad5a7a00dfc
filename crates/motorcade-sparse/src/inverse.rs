//! Selected inverse: the blocks of `(L Lᵀ)⁻¹` on the pattern of L, without forming the rest.
//!
//! Takahashi's recurrence on supernodes, from the root down. With `Y = L21 L11⁻¹` and Σ_RR the inverse over the rows
//! below (known from the parent): `Σ_RJ = −Σ_RR Y`, `Σ_JJ = L11⁻ᵀ L11⁻¹ − Yᵀ Σ_RJ`.

use nalgebra::{DMatrix, DMatrixView};

use crate::cholesky::Cholesky;
use crate::dense::solve_forward;
use crate::matrix::BlockMatrix;
use crate::stop::{Lookout, Stop};
use crate::symbolic::{Node, Symbolic};
use crate::tree::ROOT;

/// Blocks of the inverse, stored like the factor's panels.
#[derive(Clone, Debug)]
pub struct SelectedInverse {
    values: Vec<f64>,
}

/// The inverse over one front: pivots, then rows below, without padding.
struct Front {
    inverse: DMatrix<f64>,
    /// Children that still need it.
    waiting: usize,
}

impl SelectedInverse {
    /// Of the matrix with this factor; `None` when asked to stop, which is looked at some ten times a second.
    pub fn new(matrix: &BlockMatrix, factor: &Cholesky, stop: Stop<'_>) -> Option<Self> {
        let mut out = Self { values: vec![0.0; matrix.symbolic.factor_len] };
        sweep(&matrix.symbolic, factor, stop, |node, inverse| out.store(node, inverse))?;
        Some(out)
    }

    /// The blocks at `pairs` alone, original numbering, without room for those beside them, which is that of the factor: `visit` gets the index of
    /// the pair and its block, rows of the first and columns of the second, in the order of the fronts from the root down. `None` when asked
    /// to stop, or where a pair is off the pattern of L; those of the matrix are on it.
    pub fn visit(
        matrix: &BlockMatrix,
        factor: &Cholesky,
        pairs: &[(u32, u32)],
        stop: Stop<'_>,
        mut visit: impl FnMut(usize, DMatrixView<'_, f64>),
    ) -> Option<()> {
        let symbolic = &matrix.symbolic;
        let positions = |k: usize| {
            let (i, j) = pairs[k];
            (symbolic.position[i as usize], symbolic.position[j as usize])
        };
        let column = |k: usize| positions(k).0.min(positions(k).1);
        let mut left: Vec<usize> = (0..pairs.len()).collect();
        left.sort_unstable_by_key(|&k| column(k));
        let mut all_found = true;
        sweep(symbolic, factor, stop, |node, inverse| {
            while let Some(k) = left.pop_if(|k| column(*k) >= node.first) {
                let (p, q) = positions(k);
                let Some((row, col)) = symbolic.place_in_front(node, p).zip(symbolic.place_in_front(node, q))
                else {
                    all_found = false;
                    continue;
                };
                let size = (symbolic.dims[p as usize], symbolic.dims[q as usize]);
                visit(k, inverse.view((row, col), size).as_view());
            }
        })?;
        all_found.then_some(())
    }

    fn store(&mut self, node: &Node, inverse: &DMatrix<f64>) {
        let (n, ld) = (node.shape.pivots, node.shape.ld());
        for j in 0..n {
            let target = &mut self.values[node.panel + j * ld..node.panel + (j + 1) * ld];
            let column = inverse.column(j);
            for (i, &x) in column.iter().enumerate() {
                target[if i < n { i } else { i - n + node.shape.below_start() }] = x;
            }
        }
    }

    /// Block (i, j) of the inverse, original numbering.
    ///
    /// Off the pattern of L it is computed through the lowest front `l` above both: given the variables of `l` the two are
    /// independent and linear in them, so that `Σ_ij = Xᵢᵀ Σ_ll Xⱼ`. X comes by forward substitution along the path
    /// from a variable up to `l`, which is short for variables that are near each other.
    pub fn block(&self, matrix: &BlockMatrix, factor: &Cholesky, i: u32, j: u32) -> DMatrix<f64> {
        let symbolic = &matrix.symbolic;
        let (p, q) = (symbolic.position[i as usize], symbolic.position[j as usize]);
        let (row, column) = (p.max(q), p.min(q));
        let (rows, cols) = (symbolic.dims[row as usize], symbolic.dims[column as usize]);
        if let Some((from, ld)) = symbolic.block_in_factor(row, column) {
            let block = DMatrix::from_fn(rows, cols, |a, b| self.values[from + b * ld + a]);
            return if p >= q { block } else { block.transpose() };
        }
        let (s, t) = (symbolic.node_of[p as usize], symbolic.node_of[q as usize]);
        let Some(top) = symbolic.lowest_above(s, t) else {
            return DMatrix::zeros(symbolic.dims[p as usize], symbolic.dims[q as usize]);
        };
        let (left, right) = (lift(symbolic, factor, p, top), lift(symbolic, factor, q, top));
        left.transpose() * (self.front(symbolic, top) * right)
    }

    /// One diagonal block of the inverse, original numbering: the fronts from the root down to it, no others. `None` when asked to stop.
    pub fn diagonal_block(
        matrix: &BlockMatrix,
        factor: &Cholesky,
        i: u32,
        stop: Stop<'_>,
    ) -> Option<DMatrix<f64>> {
        let symbolic = &matrix.symbolic;
        let position = symbolic.position[i as usize];
        let own = symbolic.node_of[position as usize];
        let mut path = vec![own];
        while let Some(&s) = path.last()
            && symbolic.nodes[s as usize].parent != ROOT
        {
            path.push(symbolic.nodes[s as usize].parent);
        }
        let (mut inverse, mut lookout) = (DMatrix::zeros(0, 0), Lookout::new(stop, 0.0));
        for &s in path.iter().rev() {
            let node = &symbolic.nodes[s as usize];
            inverse = invert(node, factor.panel(node), &gather(symbolic, node, &inverse), &mut lookout)?;
        }
        let first = symbolic.offsets[symbolic.nodes[own as usize].first as usize];
        let (at, dim) = (symbolic.offsets[position as usize] - first, symbolic.dims[position as usize]);
        Some(inverse.view((at, at), (dim, dim)).into_owned())
    }

    /// The inverse over one front, pivots and rows below: all of it lies on the pattern.
    fn front(&self, symbolic: &Symbolic, s: u32) -> DMatrix<f64> {
        let node = &symbolic.nodes[s as usize];
        let n = node.shape.pivots + node.shape.below;
        let all: Vec<u32> =
            (node.first..node.first + node.columns).chain(node.rows.iter().copied()).collect();
        let mut out = DMatrix::zeros(n, n);
        let mut left = 0;
        for (k, &column) in all.iter().enumerate() {
            let width = symbolic.dims[column as usize];
            let mut top = left;
            for &row in &all[k..] {
                let height = symbolic.dims[row as usize];
                if let Some((from, ld)) = symbolic.block_in_factor(row, column) {
                    for b in 0..width {
                        for a in 0..height {
                            let x = self.values[from + b * ld + a];
                            out[(top + a, left + b)] = x;
                            out[(left + b, top + a)] = x;
                        }
                    }
                }
                top += height;
            }
            left += width;
        }
        out
    }
}

/// The inverse over every front, from the root down; `None` when asked to stop.
fn sweep(
    symbolic: &Symbolic,
    factor: &Cholesky,
    stop: Stop<'_>,
    mut visit: impl FnMut(&Node, &DMatrix<f64>),
) -> Option<()> {
    let mut lookout = Lookout::new(stop, 0.0);
    let mut fronts: Vec<Option<Front>> = Vec::new();
    fronts.resize_with(symbolic.nodes.len(), || None);
    for s in (0..symbolic.nodes.len()).rev() {
        let node = &symbolic.nodes[s];
        let below = match fronts.get_mut(node.parent as usize) {
            Some(slot) => {
                let below = slot.as_ref().map(|front| gather(symbolic, node, &front.inverse));
                if let Some(front) = slot {
                    front.waiting -= 1;
                }
                slot.take_if(|front| front.waiting == 0);
                below.unwrap_or_default()
            }
            None => DMatrix::zeros(node.shape.below, node.shape.below),
        };
        let inverse = invert(node, factor.panel(node), &below, &mut lookout)?;
        visit(node, &inverse);
        if !node.children.is_empty() {
            fronts[s] = Some(Front { inverse, waiting: node.children.len() });
        }
    }
    Some(())
}

/// Coefficients (front × dof) of the variable at `position` in terms of those of front `top`, an ancestor of its own.
fn lift(symbolic: &Symbolic, factor: &Cholesky, position: u32, top: u32) -> DMatrix<f64> {
    let mut s = symbolic.node_of[position as usize];
    let size = |node: &Node| node.shape.pivots + node.shape.below;
    let dof = symbolic.dims[position as usize];
    let mut x = DMatrix::zeros(size(&symbolic.nodes[s as usize]), dof);
    let at =
        symbolic.offsets[position as usize] - symbolic.offsets[symbolic.nodes[s as usize].first as usize];
    x.view_mut((at, 0), (dof, dof)).fill_with_identity();
    while s != top {
        let node = &symbolic.nodes[s as usize];
        let n = node.shape.pivots;
        let mut above = DMatrix::zeros(size(&symbolic.nodes[node.parent as usize]), dof);
        let (places, mut padded) = (places_in_parent(symbolic, node), vec![0.0; node.shape.ld()]);
        let start = node.shape.below_start();
        for k in 0..dof {
            let column = x.column(k);
            let (pivots, below) = column.as_slice().split_at(n);
            padded[..n].copy_from_slice(pivots);
            padded[start..start + node.shape.below].copy_from_slice(below);
            solve_forward(factor.panel(node), node.shape, &mut padded);
            for (&place, y) in places.iter().zip(&padded[start..]) {
                above[(place, k)] = *y;
            }
        }
        (x, s) = (above, node.parent);
    }
    x
}

/// Places of the rows below `node` in its parent's front.
fn places_in_parent(symbolic: &Symbolic, node: &Node) -> Vec<usize> {
    let parent = symbolic.nodes[node.parent as usize].shape;
    let mut places = Vec::with_capacity(node.shape.below);
    for run in &node.runs {
        let at = run.parent as usize;
        let at = if at < parent.pivots { at } else { at - parent.below_start() + parent.pivots };
        places.extend(at..at + run.len as usize);
    }
    places
}

/// The inverse over the rows below `node`, out of its parent's front.
fn gather(symbolic: &Symbolic, node: &Node, front: &DMatrix<f64>) -> DMatrix<f64> {
    let m = node.shape.below;
    if node.parent == ROOT {
        return DMatrix::zeros(m, m);
    }
    let places = places_in_parent(symbolic, node);
    DMatrix::from_fn(m, m, |i, j| front[(places[i], places[j])])
}

/// The inverse over one front, a few columns at a time, so that nobody waits for a large one; `None` when asked to stop.
fn invert(
    node: &Node,
    panel: &[f64],
    below: &DMatrix<f64>,
    lookout: &mut Lookout<'_>,
) -> Option<DMatrix<f64>> {
    let (n, m, ld) = (node.shape.pivots, node.shape.below, node.shape.ld());
    let view = DMatrixView::from_slice_with_strides(panel, ld, n, 1, ld);
    let (l11, l21) = (view.rows(0, n).lower_triangle(), view.rows(node.shape.below_start(), m));
    let mut w = DMatrix::identity(n, n); // L11⁻¹
    let mut y = DMatrix::zeros(m, n);
    let mut below_pivots = DMatrix::zeros(m, n);
    for (first, count) in strips(n, n + m) {
        let (done, rest) = ((first, first), (n - first, n - first));
        l11.view(done, rest).solve_lower_triangular_mut(&mut w.view_mut(done, (n - first, count)));
        y.columns_mut(first, count).gemm(1.0, &l21, &w.columns(first, count), 0.0);
        below_pivots.columns_mut(first, count).gemm(-1.0, below, &y.columns(first, count), 0.0);
        if lookout.stops_after(((n + m) * (n + m) * count) as f64) {
            return None;
        }
    }
    let (w_transposed, y_transposed) = (w.transpose(), y.transpose());
    let mut out = DMatrix::zeros(n + m, n + m);
    for (first, count) in strips(n, n + m) {
        let pivots =
            &w_transposed * w.columns(first, count) - &y_transposed * below_pivots.columns(first, count);
        out.view_mut((0, first), (n, count)).copy_from(&pivots);
        if lookout.stops_after((n * (n + m) * count) as f64) {
            return None;
        }
    }
    out.view_mut((n, 0), (m, n)).copy_from(&below_pivots);
    out.view_mut((0, n), (n, m)).copy_from(&below_pivots.transpose());
    out.view_mut((n, n), (m, m)).copy_from(below);
    Some(out)
}

/// First column and number of columns of strips of `columns`, in a front of `size` rows: each some 10⁸ multiplications, a small front one strip.
fn strips(columns: usize, size: usize) -> impl Iterator<Item = (usize, usize)> {
    let width = ((1 << 27) / (size * size).max(1)).max(8);
    (0..columns).step_by(width).map(move |first| (first, width.min(columns - first)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    /// Two chains with a few long ties, of blocks of mixed sizes.
    fn chains() -> (Vec<usize>, Vec<(u32, u32)>) {
        let dims: Vec<usize> = (0..60).map(|k| [6, 3, 1, 7, 2][k % 5]).collect();
        let mut pairs: Vec<(u32, u32)> = (1..60).filter(|k| *k != 40).map(|k| (k - 1, k)).collect();
        pairs.extend([(0, 20), (5, 12), (7, 30), (41, 59), (45, 50)]);
        (dims, pairs)
    }

    #[test]
    fn every_block_is_one_of_the_dense_inverse() {
        let (dims, pairs) = chains();
        let mut matrix = BlockMatrix::new(&dims, &pairs);
        let n = matrix.symbolic.len();
        let mut dense = DMatrix::<f64>::zeros(n, n);
        let itself = (0..dims.len() as u32).map(|k| (k, k));
        for (k, (i, j)) in pairs.iter().copied().chain(itself).enumerate() {
            let (rows, cols) = (dims[i as usize], dims[j as usize]);
            let mut block =
                DMatrix::from_fn(rows, cols, |a, b| ((a * 7 + b * 3 + k * 5) % 11) as f64 / 11.0 - 0.5);
            if i == j {
                block = &block * block.transpose() + DMatrix::identity(rows, rows) * 8.0;
            }
            let slot = matrix.slot(i, j).unwrap();
            matrix.add(slot, 1.0, block.as_slice(), rows, (rows, cols));
            let (at, from) = (matrix.range(i).start, matrix.range(j).start);
            dense.view_mut((at, from), (rows, cols)).copy_from(&block);
            dense.view_mut((from, at), (cols, rows)).copy_from(&block.transpose());
        }
        let mut factor = Cholesky::default();
        factor.factorise(&matrix, 0.0, false, None, Stop::NEVER).unwrap();
        let selected = SelectedInverse::new(&matrix, &factor, Stop::NEVER).unwrap();
        let inverse = dense.try_inverse().unwrap();
        let mut chosen = pairs.clone();
        chosen.extend(pairs.iter().map(|(i, j)| (*j, *i)).chain((0..dims.len() as u32).map(|k| (k, k))));
        let mut visited = vec![0; chosen.len()];
        SelectedInverse::visit(&matrix, &factor, &chosen, Stop::NEVER, |k, block| {
            let expected = selected.block(&matrix, &factor, chosen[k].0, chosen[k].1);
            assert!((block - expected).amax() < 1e-15);
            visited[k] += 1;
        });
        assert!(visited.iter().all(|times| *times == 1));
        let other_tree = [(0, 59), (0, 0)];
        assert!(SelectedInverse::visit(&matrix, &factor, &other_tree, Stop::NEVER, |_, _| ()).is_none());
        let mut off_pattern = 0;
        for i in 0..dims.len() as u32 {
            for j in 0..dims.len() as u32 {
                let (rows, columns) = (matrix.range(i), matrix.range(j));
                let expected = inverse.view((rows.start, columns.start), (rows.len(), columns.len()));
                let block = selected.block(&matrix, &factor, i, j);
                assert!((block - expected).amax() < 1e-13, "({i}, {j})");
                let (p, q) = (matrix.symbolic.position[i as usize], matrix.symbolic.position[j as usize]);
                off_pattern += usize::from(matrix.symbolic.block_in_factor(p.max(q), p.min(q)).is_none());
            }
        }
        assert!(off_pattern > 1000, "{off_pattern}");
    }

    #[test]
    fn an_inverse_is_given_up_within_a_front() {
        // One front of 1,200 rows.
        let pairs: Vec<(u32, u32)> = (0..200).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        let mut matrix = BlockMatrix::new(&vec![6; 200], &pairs);
        for k in 0..200 {
            let slot = matrix.slot(k, k).unwrap();
            matrix.add(slot, 4.0, DMatrix::<f64>::identity(6, 6).as_slice(), 6, (6, 6));
        }
        let mut factor = Cholesky::default();
        factor.factorise(&matrix, 0.0, false, None, Stop::NEVER).unwrap();
        let (looks, quarter) = (AtomicUsize::new(0), DMatrix::identity(6, 6) / 4.0);
        let inverse = |stops_at: usize| {
            looks.store(0, Ordering::Relaxed);
            let asked = || looks.fetch_add(1, Ordering::Relaxed) + 1 == stops_at;
            let diagonal: Vec<(u32, u32)> = (0..200).map(|k| (k, k)).collect();
            let mut blocks = 0;
            let each = |_, block: DMatrixView<'_, f64>| blocks += usize::from(block == quarter);
            let done = SelectedInverse::visit(&matrix, &factor, &diagonal, Stop::new(&asked), each);
            (done.map(|()| blocks), looks.load(Ordering::Relaxed))
        };
        let (blocks, all) = inverse(usize::MAX);
        assert_eq!(blocks, Some(200));
        assert!((6..60).contains(&all), "{all}");
        for stops_at in [1, all / 2, all] {
            assert_eq!(inverse(stops_at), (None, stops_at));
        }
        let block = |stop| SelectedInverse::diagonal_block(&matrix, &factor, 7, stop);
        assert!(block(Stop::NEVER) == Some(quarter) && block(Stop::new(&|| true)).is_none());
    }
}
