//! Selected inverse: the blocks of `(L Lᵀ)⁻¹` on the pattern of L, without forming the rest.
//!
//! Takahashi's recurrence on supernodes, from the root down. With `Y = L21 L11⁻¹` and Σ_RR the inverse over the rows
//! below (known from the parent): `Σ_RJ = −Σ_RR Y`, `Σ_JJ = L11⁻ᵀ L11⁻¹ − Yᵀ Σ_RJ`.

use nalgebra::{DMatrix, DMatrixView};

use super::cholesky::Cholesky;
use super::symbolic::{Node, Symbolic};
use super::tree::ROOT;

/// Blocks of the inverse, stored like the factor's panels.
#[derive(Clone, Debug)]
pub(crate) struct SelectedInverse {
    values: Vec<f64>,
}

/// The inverse over one front: pivots, then rows below, without padding.
struct Front {
    inverse: DMatrix<f64>,
    /// Children that still need it.
    waiting: usize,
}

impl SelectedInverse {
    pub(crate) fn new(symbolic: &Symbolic, factor: &Cholesky) -> Self {
        let mut out = Self { values: vec![0.0; symbolic.factor_len] };
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
            let inverse = invert(node, factor.panel(node), &below);
            out.store(node, &inverse);
            if !node.children.is_empty() {
                fronts[s] = Some(Front { inverse, waiting: node.children.len() });
            }
        }
        out
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

    /// Block (i, j) in original numbering; `None` off the pattern of L.
    pub(crate) fn block(&self, symbolic: &Symbolic, i: u32, j: u32) -> Option<DMatrix<f64>> {
        let (p, q) = (*symbolic.position.get(i as usize)?, *symbolic.position.get(j as usize)?);
        let (row, column) = (p.max(q), p.min(q));
        let node = &symbolic.nodes[symbolic.node_of[column as usize] as usize];
        let first = symbolic.offsets[node.first as usize];
        let start = if row < node.first + node.columns {
            symbolic.offsets[row as usize] - first
        } else {
            let at = node.rows.binary_search(&row).ok()?;
            let above: usize = node.rows[..at].iter().map(|&r| symbolic.dims[r as usize]).sum();
            node.shape.below_start() + above
        };
        let ld = node.shape.ld();
        let from = node.panel + (symbolic.offsets[column as usize] - first) * ld + start;
        let (rows, cols) = (symbolic.dims[row as usize], symbolic.dims[column as usize]);
        let block = DMatrix::from_fn(rows, cols, |a, b| self.values[from + b * ld + a]);
        Some(if p >= q { block } else { block.transpose() })
    }
}

/// One diagonal block of the inverse, original numbering: the fronts from the root down to it, no others.
pub(crate) fn diagonal_block(symbolic: &Symbolic, factor: &Cholesky, i: u32) -> DMatrix<f64> {
    let position = symbolic.position[i as usize];
    let own = symbolic.node_of[position as usize];
    let mut path = vec![own];
    while let Some(&s) = path.last()
        && symbolic.nodes[s as usize].parent != ROOT
    {
        path.push(symbolic.nodes[s as usize].parent);
    }
    let mut inverse = DMatrix::zeros(0, 0);
    for &s in path.iter().rev() {
        let node = &symbolic.nodes[s as usize];
        inverse = invert(node, factor.panel(node), &gather(symbolic, node, &inverse));
    }
    let first = symbolic.offsets[symbolic.nodes[own as usize].first as usize];
    let (at, dim) = (symbolic.offsets[position as usize] - first, symbolic.dims[position as usize]);
    inverse.view((at, at), (dim, dim)).into_owned()
}

/// The inverse over the rows below `node`, out of its parent's front.
fn gather(symbolic: &Symbolic, node: &Node, front: &DMatrix<f64>) -> DMatrix<f64> {
    let m = node.shape.below;
    if node.parent == ROOT {
        return DMatrix::zeros(m, m);
    }
    let parent = symbolic.nodes[node.parent as usize].shape;
    let mut place = Vec::with_capacity(m);
    for run in &node.runs {
        let at = run.parent as usize;
        let at = if at < parent.pivots { at } else { at - parent.below_start() + parent.pivots };
        place.extend(at..at + run.len as usize);
    }
    DMatrix::from_fn(m, m, |i, j| front[(place[i], place[j])])
}

fn invert(node: &Node, panel: &[f64], below: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m, ld) = (node.shape.pivots, node.shape.below, node.shape.ld());
    let view = DMatrixView::from_slice_with_strides(panel, ld, n, 1, ld);
    let l11 = view.rows(0, n).lower_triangle();
    let mut w = DMatrix::identity(n, n);
    l11.solve_lower_triangular_mut(&mut w); // L11⁻¹
    let y = view.rows(node.shape.below_start(), m) * &w; // m×n
    let below_pivots = -(below * &y); // m×n
    let pivots = w.transpose() * &w - y.transpose() * &below_pivots;
    let mut out = DMatrix::zeros(n + m, n + m);
    out.view_mut((0, 0), (n, n)).copy_from(&pivots);
    out.view_mut((n, 0), (m, n)).copy_from(&below_pivots);
    out.view_mut((0, n), (n, m)).copy_from(&below_pivots.transpose());
    out.view_mut((n, n), (m, m)).copy_from(below);
    out
}
