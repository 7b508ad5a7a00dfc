//! A symmetric block matrix with a fixed pattern, stored as the lower blocks in elimination order.

use crate::assembly::{PairSlots, add_pair};
use crate::memory::Numbers;
use crate::slot::Slot;
use crate::symbolic::{Ordering, Symbolic};

/// Symmetric block-sparse matrix and right-hand side. Blocks are column-major; of diagonal blocks only the lower
/// triangle counts.
#[derive(Clone, Debug)]
pub struct BlockMatrix {
    pub(crate) symbolic: Symbolic,
    /// Start of every block column in `rows` and `starts`.
    columns: Vec<u32>,
    /// Row position of every block; the first of a column is its diagonal block.
    rows: Vec<u32>,
    /// First scalar of every block.
    starts: Vec<usize>,
    /// Place of every block in the factor's panels.
    targets: Vec<usize>,
    values: Numbers,
    /// Right-hand side, in elimination order.
    pub rhs: Vec<f64>,
}

impl BlockMatrix {
    /// Matrix over blocks of `dims` with entries at `pairs` (any order, repetition allowed, self pairs ignored).
    pub fn new(dims: &[usize], pairs: &[(u32, u32)]) -> Self {
        Self::ordered(dims, pairs, Ordering::LeastWork)
    }

    /// The same in an elimination order for a purpose.
    pub fn ordered(dims: &[usize], pairs: &[(u32, u32)], ordering: Ordering) -> Self {
        let adjacency = adjacency(dims.len(), pairs);
        let symbolic = Symbolic::new(dims, &adjacency, ordering);
        let blocks = dims.len() + adjacency.iter().map(Vec::len).sum::<usize>() / 2;
        let mut out = Self {
            columns: vec![0],
            rows: Vec::with_capacity(blocks),
            starts: Vec::with_capacity(blocks),
            targets: Vec::with_capacity(blocks),
            values: Numbers::default(),
            rhs: vec![0.0; symbolic.len()],
            symbolic,
        };
        let mut start = 0;
        for k in 0..dims.len() as u32 {
            let symbolic = &out.symbolic;
            let near = &adjacency[symbolic.order[k as usize] as usize];
            let from = out.rows.len();
            out.rows.push(k);
            out.rows.extend(near.iter().map(|&j| symbolic.position[j as usize]).filter(|&r| r > k));
            out.rows[from..].sort_unstable();
            out.columns.push(out.rows.len() as u32);
            for b in from..out.rows.len() {
                out.starts.push(start);
                start += symbolic.dims[k as usize] * symbolic.dims[out.rows[b] as usize];
            }
            out.find_targets(k, from);
        }
        out.values = Numbers::zeros(start);
        out
    }

    fn find_targets(&mut self, k: u32, from: usize) {
        let symbolic = &self.symbolic;
        let node = &symbolic.nodes[symbolic.node_of[k as usize] as usize];
        let first = symbolic.offsets[node.first as usize];
        let column = node.panel + (symbolic.offsets[k as usize] - first) * node.shape.ld();
        let end = node.first + node.columns;
        let (mut at, mut row_start) = (0, node.shape.below_start());
        for b in from..self.rows.len() {
            let row = self.rows[b];
            let place = if row < end {
                symbolic.offsets[row as usize] - first
            } else {
                while node.rows[at] < row {
                    row_start += symbolic.dims[node.rows[at] as usize];
                    at += 1;
                }
                row_start
            };
            self.targets.push(column + place);
        }
    }

    /// Zeroes matrix and right-hand side.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.rhs.fill(0.0);
    }

    /// Index of the block (i, j), original numbering, and whether it is stored transposed. `None` when the pair is not
    /// in the pattern.
    fn find(&self, i: u32, j: u32) -> Option<(usize, bool)> {
        let (p, q) = (*self.symbolic.position.get(i as usize)?, *self.symbolic.position.get(j as usize)?);
        let (row, column, transposed) = if p >= q { (p, q, false) } else { (q, p, true) };
        let (from, to) = (self.columns[column as usize] as usize, self.columns[column as usize + 1] as usize);
        let k = self.rows[from..to].binary_search(&row).ok()?;
        Some((from + k, transposed))
    }

    /// Slot of the block (i, j), original numbering. `None` when the pair is not in the pattern.
    pub fn slot(&self, i: u32, j: u32) -> Option<Slot> {
        let (block, transposed) = self.find(i, j)?;
        Some(Slot { offset: self.starts[block] as u32, transposed, first: false })
    }

    /// Slots of many blocks that are always filled in this order: the first share of each block overwrites what was
    /// there, so the matrix need not be cleared.
    pub fn slots(&self, pairs: impl Iterator<Item = (u32, u32)>) -> Vec<Option<Slot>> {
        let mut first = vec![true; self.starts.len()];
        pairs
            .map(|(i, j)| {
                let (block, transposed) = self.find(i, j)?;
                let first = std::mem::replace(&mut first[block], false);
                Some(Slot { offset: self.starts[block] as u32, transposed, first })
            })
            .collect()
    }

    /// Adds `scale` times the rows×cols block of `local` (column-major, leading dimension `ld`) at `slot`.
    #[inline]
    pub fn add(&mut self, slot: Slot, scale: f64, local: &[f64], ld: usize, (rows, cols): (usize, usize)) {
        let Some(block) = self.values.get_mut(slot.offset as usize..).and_then(|v| v.get_mut(..rows * cols))
        else {
            return;
        };
        if slot.first {
            block.fill(0.0);
        }
        if slot.transposed {
            for (i, column) in block.chunks_exact_mut(cols).enumerate() {
                for (j, x) in column.iter_mut().enumerate() {
                    *x += scale * local[j * ld + i];
                }
            }
        } else {
            for (column, source) in block.chunks_exact_mut(rows).zip(local.chunks(ld)) {
                for (x, y) in column.iter_mut().zip(source) {
                    *x += scale * y;
                }
            }
        }
    }

    /// Adds `weight` times H (12×12, column-major, lower blocks) of two blocks of six scalars to the matrix, and g (12)
    /// negated to the right-hand side.
    #[inline]
    pub fn add_pair(&mut self, share: (&[f64; 12], &[f64; 144]), weight: f64, slots: &PairSlots) {
        add_pair(&mut self.values, &mut self.rhs, share, weight, slots);
    }

    /// Adds to the right-hand side of block `i` (original numbering).
    pub fn add_rhs(&mut self, i: u32, scale: f64, local: &[f64]) {
        let range = self.range(i);
        for (x, y) in self.rhs[range].iter_mut().zip(local) {
            *x += scale * y;
        }
    }

    /// Scalar range of block `i` (original numbering) in vectors in elimination order.
    pub fn range(&self, i: u32) -> std::ops::Range<usize> {
        let p = self.symbolic.position[i as usize] as usize;
        self.symbolic.offsets[p]..self.symbolic.offsets[p + 1]
    }

    /// Scalar rows.
    pub fn len(&self) -> usize {
        self.symbolic.len()
    }

    /// True without blocks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Scalars of the factor.
    pub fn factor_len(&self) -> usize {
        self.symbolic.factor_len
    }

    /// Multiplications of a factorisation, roughly.
    pub fn factor_multiplications(&self) -> f64 {
        self.symbolic.flops
    }

    /// True for blocks of just these sizes, original numbering.
    pub fn has_blocks(&self, dims: &[usize]) -> bool {
        let own = self.symbolic.position.iter().map(|&p| self.symbolic.dims[p as usize]);
        own.eq(dims.iter().copied())
    }

    /// Diagonal of the matrix.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.symbolic.dims.len()).flat_map(move |k| {
            let (start, d) = (self.starts[self.columns[k] as usize], self.symbolic.dims[k]);
            (0..d).map(move |i| self.values[start + i * (d + 1)])
        })
    }

    /// `xᵀ H x`.
    pub fn quadratic_form(&self, x: &[f64]) -> f64 {
        let symbolic = &self.symbolic;
        let mut total = 0.0;
        for k in 0..symbolic.dims.len() {
            let (dk, xk) = (symbolic.dims[k], &x[symbolic.offsets[k]..symbolic.offsets[k + 1]]);
            for b in self.columns[k] as usize..self.columns[k + 1] as usize {
                let r = self.rows[b] as usize;
                let (dr, xr) = (symbolic.dims[r], &x[symbolic.offsets[r]..symbolic.offsets[r + 1]]);
                for j in 0..dk {
                    for i in if r == k { j..dr } else { 0..dr } {
                        let twice = if r == k && i == j { 1.0 } else { 2.0 };
                        total += twice * self.values[self.starts[b] + j * dr + i] * xr[i] * xk[j];
                    }
                }
            }
        }
        total
    }

    /// Writes the columns of supernode `s` and `lambda` on their diagonal into the cleared panel.
    pub(crate) fn fill_panel(&self, s: usize, lambda: f64, panel: &mut [f64]) {
        let symbolic = &self.symbolic;
        let node = &symbolic.nodes[s];
        let ld = node.shape.ld();
        for k in node.first as usize..(node.first + node.columns) as usize {
            let cols = symbolic.dims[k];
            for b in self.columns[k] as usize..self.columns[k + 1] as usize {
                let rows = symbolic.dims[self.rows[b] as usize];
                let block = &self.values[self.starts[b]..self.starts[b] + rows * cols];
                let target = self.targets[b] - node.panel;
                if rows == 6 && cols == 6 {
                    for j in 0..6 {
                        panel[target + j * ld..target + j * ld + 6].copy_from_slice(&block[6 * j..6 * j + 6]);
                    }
                } else {
                    for j in 0..cols {
                        let column = &block[rows * j..rows * (j + 1)];
                        panel[target + j * ld..target + j * ld + rows].copy_from_slice(column);
                    }
                }
            }
        }
        if lambda != 0.0 {
            for j in 0..node.shape.pivots {
                panel[j * (ld + 1)] += lambda;
            }
        }
    }
}

/// Neighbour lists without self loops or repetition, increasing.
fn adjacency(n: usize, pairs: &[(u32, u32)]) -> Vec<Vec<u32>> {
    let mut counts = vec![0; n];
    for &(i, j) in pairs {
        counts[i as usize] += 1;
        counts[j as usize] += 1;
    }
    let mut near: Vec<Vec<u32>> = counts.into_iter().map(Vec::with_capacity).collect();
    for &(i, j) in pairs.iter().filter(|(i, j)| i != j) {
        near[i as usize].push(j);
        near[j as usize].push(i);
    }
    for list in &mut near {
        list.sort_unstable();
        list.dedup();
    }
    near
}
