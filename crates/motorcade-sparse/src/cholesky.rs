//! Multifrontal supernodal Cholesky `H + λI = L Lᵀ` in elimination order.
//!
//! Supernodes are visited in postorder. Each assembles its columns of `H` and the Schur complements of its children
//! into its panel, factorises it and passes its own Schur complement up. Schur complements live on two stacks, one
//! for even and one for odd depths: the complements of a node's children are then always the top of one stack while
//! its own grows on the other, so nothing is moved and nothing is allocated after the first factorisation.

use std::ops::Range;

use rayon::prelude::*;

use crate::dense::{factor_panel, schur_complement, solve_backward, solve_forward};
use crate::extend::{PanelRuns, extend_add};
use crate::matrix::BlockMatrix;
use crate::memory::Numbers;
use crate::stop::{Lookout, Stop};
use crate::symbolic::{Node, Symbolic};
use crate::tree::ROOT;
use crate::unfactorised::Unfactorised;

/// A factor; its memory is reused from one factorisation to the next of the same pattern.
#[derive(Clone, Debug, Default)]
pub struct Cholesky {
    /// All panels.
    values: Numbers,
    stacks: [Stack; 2],
    plan: Plan,
    /// Smallest and largest diagonal entry of L.
    pivots: (f64, f64),
    scratch: Vec<f64>,
}

/// Subtrees that are factorised independently of one another; what remains is done afterwards.
#[derive(Clone, Debug, Default)]
struct Plan {
    /// Roots of the subtrees, increasing.
    roots: Vec<u32>,
    ready: bool,
}

impl Cholesky {
    /// Factorises `matrix + lambda I` and solves `L y = x` (elimination order) in place during the factorisation, while the
    /// columns are in the cache. `parallel` uses the current thread pool of `rayon`; the result is the same.
    ///
    /// # Errors
    /// A pivot that is not positive; a request to stop, which is looked at some twenty times a second.
    pub fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        lambda: f64,
        parallel: bool,
        mut x: Option<&mut [f64]>,
        stop: Stop<'_>,
    ) -> Result<(), Unfactorised> {
        let symbolic = &matrix.symbolic;
        if self.values.len() != symbolic.factor_len {
            self.values = Numbers::zeros(symbolic.factor_len);
        }
        self.pivots = (f64::INFINITY, 0.0);
        if !self.plan.ready {
            self.plan = Plan { roots: independent_subtrees(symbolic), ready: true };
            self.stacks = Stack::pair(symbolic, 0..symbolic.nodes.len());
        }
        if !parallel || self.plan.roots.len() < 2 {
            let [even, odd] = &mut self.stacks;
            (even.top, odd.top) = (0, 0);
            let lookout = Lookout::new(stop, 0.0);
            let mut work =
                Work { matrix, lambda, base: 0, values: &mut self.values, stacks: [even, odd], lookout };
            for (s, node) in symbolic.nodes.iter().enumerate() {
                merge(&mut self.pivots, work.eliminate(s, &mut [])?);
                if let Some(x) = &mut x {
                    let panel = &work.values[node.panel..node.panel + node.shape.len()];
                    forward(symbolic, node, panel, x, &mut self.scratch);
                }
            }
            return Ok(());
        }
        self.factorise_parallel(matrix, lambda, stop)?;
        if let Some(x) = x {
            self.solve_forward(matrix, x);
        }
        Ok(())
    }

    /// Gives back the memory that only a factorisation needs; the next one takes it again.
    pub fn shrink(&mut self) {
        (self.stacks, self.plan) = Default::default();
    }

    fn factorise_parallel(
        &mut self,
        matrix: &BlockMatrix,
        lambda: f64,
        stop: Stop<'_>,
    ) -> Result<(), Unfactorised> {
        let symbolic = &matrix.symbolic;
        // Cut the factor into the subtrees' ranges and the gaps between them.
        let mut pieces: Vec<(u32, &mut [f64])> = Vec::new();
        let (mut rest, mut at) = (&mut *self.values, 0);
        for &root in &self.plan.roots {
            let node = &symbolic.nodes[root as usize];
            let start = symbolic.nodes[node.first_descendant as usize].panel;
            let end = node.panel + node.shape.len();
            let (_, tail) = rest.split_at_mut(start - at);
            let (piece, tail) = tail.split_at_mut(end - start);
            pieces.push((root, piece));
            (rest, at) = (tail, end);
        }
        let done: Result<Vec<_>, _> = pieces
            .into_par_iter()
            .map(|(root, values)| {
                let first = symbolic.nodes[root as usize].first_descendant as usize;
                let [mut even, mut odd] = Stack::pair(symbolic, first..root as usize + 1);
                let mut pivots = (f64::INFINITY, 0.0);
                let base = symbolic.nodes[first].panel;
                let lookout = Lookout::new(stop, symbolic.nodes[first].work_before);
                let stacks = [&mut even, &mut odd];
                let mut work = Work { matrix, lambda, base, values, stacks, lookout };
                for s in first..=root as usize {
                    merge(&mut pivots, work.eliminate(s, &mut [])?);
                }
                let top = if symbolic.nodes[root as usize].depth.is_multiple_of(2) {
                    even.values
                } else {
                    odd.values
                };
                Ok((pivots, top))
            })
            .collect();
        let done = done?;
        let mut tops: Vec<Numbers> = vec![Numbers::default(); symbolic.nodes.len()];
        for (&root, (pivots, top)) in self.plan.roots.iter().zip(done) {
            merge(&mut self.pivots, pivots);
            tops[root as usize] = top;
        }
        let [even, odd] = &mut self.stacks;
        (even.top, odd.top) = (0, 0);
        let lookout = Lookout::new(stop, 0.0);
        let mut work =
            Work { matrix, lambda, base: 0, values: &mut self.values, stacks: [even, odd], lookout };
        let mut roots = self.plan.roots.iter().peekable();
        let mut s = 0;
        while s < symbolic.nodes.len() {
            // Skip finished subtrees.
            if let Some(&&root) = roots.peek()
                && s == symbolic.nodes[root as usize].first_descendant as usize
            {
                s = root as usize + 1;
                roots.next();
                continue;
            }
            merge(&mut self.pivots, work.eliminate(s, &mut tops)?);
            s += 1;
        }
        Ok(())
    }

    /// The columns of a supernode.
    pub(crate) fn panel(&self, node: &Node) -> &[f64] {
        &self.values[node.panel..node.panel + node.shape.len()]
    }

    /// Ratio of the extreme pivots squared: a lower bound of the condition number.
    pub fn condition(&self) -> f64 {
        (self.pivots.1 / self.pivots.0).powi(2)
    }

    /// Logarithm of the determinant of `matrix`, which was factorised last.
    pub fn log_determinant(&self, matrix: &BlockMatrix) -> f64 {
        let of_columns = |node: &Node| {
            let (panel, ld) = (self.panel(node), node.shape.ld());
            (0..node.shape.pivots).map(|j| panel[j * ld + j].ln()).sum::<f64>()
        };
        2.0 * matrix.symbolic.nodes.iter().map(of_columns).sum::<f64>()
    }

    /// Solves `L Lᵀ x = b` in place, elimination order.
    pub fn solve(&mut self, matrix: &BlockMatrix, x: &mut [f64]) {
        self.solve_forward(matrix, x);
        self.solve_backward(matrix, x);
    }

    /// Solves `Lᵀ x = y` in place, elimination order.
    pub fn solve_backward(&mut self, matrix: &BlockMatrix, x: &mut [f64]) {
        let symbolic = &matrix.symbolic;
        for node in symbolic.nodes.iter().rev() {
            let shape = node.shape;
            let pivots = symbolic.pivots(node);
            self.scratch.clear();
            self.scratch.extend_from_slice(&x[pivots.clone()]);
            self.scratch.resize(shape.below_start(), 0.0);
            for &row in &node.rows {
                let range = symbolic.offsets[row as usize]..symbolic.offsets[row as usize + 1];
                self.scratch.extend_from_slice(&x[range]);
            }
            self.scratch.resize(shape.ld(), 0.0);
            let panel = &self.values[node.panel..node.panel + shape.len()];
            solve_backward(panel, shape, &mut self.scratch);
            x[pivots].copy_from_slice(&self.scratch[..shape.pivots]);
        }
    }

    /// Solves `L y = x` in place, elimination order.
    fn solve_forward(&mut self, matrix: &BlockMatrix, x: &mut [f64]) {
        let _within = self.solve_forward_within(matrix, x, f64::INFINITY);
    }

    /// Solves `L y = x` in place, elimination order, and returns `yᵀ y`, which is `xᵀ H⁻¹ x`; `None` as soon as that is
    /// more than `limit`.
    pub fn solve_forward_within(&mut self, matrix: &BlockMatrix, x: &mut [f64], limit: f64) -> Option<f64> {
        let (symbolic, mut square) = (&matrix.symbolic, 0.0);
        for node in &symbolic.nodes {
            let panel = &self.values[node.panel..node.panel + node.shape.len()];
            forward(symbolic, node, panel, x, &mut self.scratch);
            square += x[symbolic.pivots(node)].iter().map(|y| y * y).sum::<f64>();
            if square > limit {
                return None;
            }
        }
        Some(square)
    }
}

/// One supernode's part of `L y = x`.
fn forward(symbolic: &Symbolic, node: &Node, panel: &[f64], x: &mut [f64], front: &mut Vec<f64>) {
    let pivots = symbolic.pivots(node);
    front.clear();
    front.extend_from_slice(&x[pivots.clone()]);
    front.resize(node.shape.ld(), 0.0);
    solve_forward(panel, node.shape, front);
    x[pivots].copy_from_slice(&front[..node.shape.pivots]);
    let mut below = &front[node.shape.below_start()..];
    for &row in &node.rows {
        let target = &mut x[symbolic.offsets[row as usize]..symbolic.offsets[row as usize + 1]];
        for (x, y) in target.iter_mut().zip(below) {
            *x += y;
        }
        below = &below[target.len()..];
    }
}

fn merge(pivots: &mut (f64, f64), new: (f64, f64)) {
    *pivots = (pivots.0.min(new.0), pivots.1.max(new.1));
}

/// A stack of Schur complements. Values above the top are stale and are overwritten, not cleared.
#[derive(Clone, Debug, Default)]
struct Stack {
    values: Numbers,
    top: usize,
}

impl Stack {
    /// The stacks, even and odd, for a pass over the supernodes of a range.
    fn pair(symbolic: &Symbolic, range: Range<usize>) -> [Self; 2] {
        let (mut top, mut most) = ([0_usize; 2], [0; 2]);
        let size = |node: &Node| if node.parent == ROOT { 0 } else { node.shape.schur_len() };
        for node in &symbolic.nodes[range] {
            let own = node.depth as usize % 2;
            top[own] += size(node);
            most[own] = most[own].max(top[own]);
            top[1 - own] -= node.children.iter().map(|&c| size(&symbolic.nodes[c as usize])).sum::<usize>();
        }
        most.map(|len| Self { values: Numbers::zeros(len), top: 0 })
    }

    fn push(&mut self, len: usize) -> &mut [f64] {
        let from = self.top;
        self.top += len;
        &mut self.values[from..self.top]
    }
}

/// State of one sequential pass over a range of supernodes.
struct Work<'a> {
    matrix: &'a BlockMatrix,
    lambda: f64,
    /// Place in the factor of the first scalar of `values`.
    base: usize,
    values: &'a mut [f64],
    stacks: [&'a mut Stack; 2],
    lookout: Lookout<'a>,
}

impl Work<'_> {
    /// Eliminates supernode `s`; `tops` holds Schur complements of children finished elsewhere.
    fn eliminate(&mut self, s: usize, tops: &mut [Numbers]) -> Result<(f64, f64), Unfactorised> {
        let symbolic = &self.matrix.symbolic;
        let node = &symbolic.nodes[s];
        let start = node.panel - self.base;
        let panel = &mut self.values[start..start + node.shape.len()];
        panel.fill(0.0);
        self.matrix.fill_panel(s, self.lambda, panel);
        let parity = node.depth as usize % 2;
        let [even, odd] = &mut self.stacks;
        let (own, theirs) = if parity == 0 { (even, odd) } else { (odd, even) };
        let on_stack = |c: u32| tops.get(c as usize).is_none_or(|t| t.is_empty());
        let size = |c: u32| symbolic.nodes[c as usize].shape.schur_len();
        let children_len: usize = node.children.iter().filter(|&&c| on_stack(c)).map(|&c| size(c)).sum();
        let children_start = theirs.top - children_len;
        let (stacked, tops, on_stack, size) = (&theirs.values[..], &*tops, &on_stack, &size);
        let schurs = || {
            let mut at = children_start;
            node.children.iter().map(move |&c| {
                let schur = if on_stack(c) {
                    at += size(c);
                    &stacked[at - size(c)..at]
                } else {
                    &tops[c as usize][..size(c)]
                };
                (&symbolic.nodes[c as usize], schur)
            })
        };
        for (child, schur) in schurs() {
            add_to_panel(child, node, schur, panel);
        }
        let pivots = factor_panel(panel, node.shape, &mut self.lookout)?;
        if node.parent != ROOT {
            let out = own.push(node.shape.schur_len());
            schur_complement(panel, node.shape, out, &mut self.lookout)?;
            for (child, schur) in schurs() {
                add_to_schur(child, node, schur, out);
            }
        }
        theirs.top = children_start;
        Ok((pivots.smallest, pivots.largest))
    }
}

/// Adds the columns of a child's Schur complement that are pivots of the parent.
fn add_to_panel(child: &Node, parent: &Node, schur: &[f64], panel: &mut [f64]) {
    let columns = child.pivot_runs(parent);
    let place = PanelRuns { runs: &child.runs, columns, shift: 0, ld: parent.shape.ld() };
    extend_add(schur, child.shape.schur_ld(), place, panel);
}

/// Adds the columns of a child's Schur complement that lie below the parent's pivots.
fn add_to_schur(child: &Node, parent: &Node, schur: &[f64], out: &mut [f64]) {
    let runs = &child.runs[child.pivot_runs(parent)..];
    let (shift, ld) = (parent.shape.below_start(), parent.shape.schur_ld());
    extend_add(schur, child.shape.schur_ld(), PanelRuns { runs, columns: runs.len(), shift, ld }, out);
}

/// Roots of disjoint subtrees of at most a sixteenth of the work each.
fn independent_subtrees(symbolic: &Symbolic) -> Vec<u32> {
    let work = |n: &Node| {
        let (p, m) = (n.shape.pivots as f64, n.shape.below as f64);
        p * p * p / 3.0 + p * p * m + p * m * m + 50.0 * (p + m) * (p + m) + 1000.0
    };
    let mut total: Vec<f64> = symbolic.nodes.iter().map(work).collect();
    for s in 0..total.len() {
        let parent = symbolic.nodes[s].parent;
        if parent != ROOT {
            total[parent as usize] += total[s];
        }
    }
    let all: f64 = symbolic.nodes.iter().map(work).sum();
    let limit = all / 16.0;
    let mut roots = Vec::new();
    for (s, node) in symbolic.nodes.iter().enumerate() {
        let top = node.parent == ROOT || total[node.parent as usize] > limit;
        if total[s] <= limit && top {
            roots.push(s as u32);
        }
    }
    roots
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    /// A full matrix of poses: one front, of some 10⁹ multiplications.
    fn full(poses: u32) -> BlockMatrix {
        let pairs: Vec<(u32, u32)> = (0..poses).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        let mut matrix = BlockMatrix::new(&vec![6; poses as usize], &pairs);
        for k in 0..poses {
            let diagonal: Vec<f64> = (0..36).map(|x| f64::from(u8::from(x % 7 == 0))).collect();
            let slot = matrix.slot(k, k).unwrap();
            matrix.add(slot, 1.0, &diagonal, 6, (6, 6));
        }
        matrix
    }

    #[test]
    fn a_factorisation_is_given_up_within_a_front() {
        let matrix = full(400);
        let looks = AtomicUsize::new(0);
        let count = |stops_at: usize| {
            looks.store(0, Ordering::Relaxed);
            let asked = || looks.fetch_add(1, Ordering::Relaxed) + 1 == stops_at;
            let done = Cholesky::default().factorise(&matrix, 0.0, false, None, Stop::new(&asked));
            (done, looks.load(Ordering::Relaxed))
        };
        let (done, all) = count(usize::MAX);
        assert!(done.is_ok() && (4..40).contains(&all), "{all}");
        assert_eq!(count(2), (Err(Unfactorised::Stopped), 2));
    }

    #[test]
    fn a_small_matrix_is_factorised_whatever_is_asked() {
        let matrix = full(20);
        let mut factor = Cholesky::default();
        assert!(factor.factorise(&matrix, 0.0, false, None, Stop::new(&|| true)).is_ok());
    }
}
