//! Symbolic analysis: everything about a factorisation that depends on the pattern alone.

use crate::dense::Shape;
use crate::dissection::Cuts;
use crate::tree::{ROOT, Upper};
use crate::{amd, dissection, supernodes, tree};

/// A stretch of rows of a child's Schur complement that is also a stretch of its parent's front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// First scalar row in the child's Schur complement.
    pub child: u32,
    /// First scalar row in the parent's panel (padding included).
    pub parent: u32,
    /// Scalar rows.
    pub len: u32,
}

/// One supernode.
#[derive(Clone, Debug, Default)]
pub(crate) struct Node {
    /// First block column; they are consecutive.
    pub first: u32,
    /// Number of block columns.
    pub columns: u32,
    /// Block rows below, increasing.
    pub rows: Vec<u32>,
    /// Scalar shape of the panel.
    pub shape: Shape,
    /// Supernode holding the first row below, `ROOT` for none.
    pub parent: u32,
    /// First supernode of the subtree (supernodes are in postorder).
    pub first_descendant: u32,
    /// Children, increasing.
    pub children: Vec<u32>,
    /// First scalar of the panel in the factor.
    pub panel: usize,
    /// Places of the rows of the Schur complement in the parent's front.
    pub runs: Vec<Run>,
    /// Distance from the root.
    pub depth: u32,
    /// Multiplications for the supernodes before it, roughly.
    pub work_before: f64,
}

impl Node {
    /// Number of runs that are pivots of the parent.
    pub(crate) fn pivot_runs(&self, parent: &Self) -> usize {
        self.runs.iter().take_while(|r| (r.parent as usize) < parent.shape.pivots).count()
    }
}

/// The analysed pattern.
#[derive(Clone, Debug, Default)]
pub(crate) struct Symbolic {
    /// Original block at each position.
    pub order: Vec<u32>,
    /// Position of each original block.
    pub position: Vec<u32>,
    /// Scalars of the block at each position.
    pub dims: Vec<usize>,
    /// First scalar of the block at each position; one more at the end.
    pub offsets: Vec<usize>,
    /// Supernodes in postorder.
    pub nodes: Vec<Node>,
    /// Supernode of each position.
    pub node_of: Vec<u32>,
    /// Scalars of all panels.
    pub factor_len: usize,
    /// Multiplications of the factorisation, roughly.
    pub flops: f64,
}

/// Block multiplications of a factorisation for every entry of the matrix above which nested dissection is tried.
const WORK_WORTH_DISSECTING: f64 = 60.0;

/// Purpose of an elimination order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ordering {
    /// Least work of a factorisation.
    LeastWork,
    /// Short paths from every variable to the root, for a selected inverse. Minimum degree eliminates a chain from its end; the recurrence of the
    /// inverse then extrapolates along the chain and multiplies rounding errors. Between separators it interpolates.
    ShortPaths,
}

/// An ordering and its elimination tree.
struct Tree {
    order: Vec<u32>,
    parent: Vec<u32>,
    counts: Vec<u32>,
    /// Σ counts² / 2: block multiplications, roughly.
    work: f64,
}

impl Tree {
    fn new(adjacency: &[Vec<u32>], first: &[u32]) -> Self {
        let parent = tree::elimination_tree(&Upper::new(adjacency, first));
        let order = compose(first, &tree::postorder(&parent));
        let upper = Upper::new(adjacency, &order);
        let parent = tree::elimination_tree(&upper);
        let counts = tree::column_counts(&upper, &parent);
        let work = counts.iter().map(|&c| 0.5 * f64::from(c) * f64::from(c)).sum();
        Self { order, parent, counts, work }
    }

    /// By minimum degree, or by nested dissection, which takes longer and pays for graphs like a mesh, which fill in much.
    fn of_least_work(adjacency: &[Vec<u32>]) -> Self {
        let tree = Self::new(adjacency, &amd::order(adjacency.to_vec()));
        let edges: usize = adjacency.iter().map(Vec::len).sum();
        if tree.work <= WORK_WORTH_DISSECTING * edges as f64 {
            return tree;
        }
        let dissected = Self::new(adjacency, &dissection::order(adjacency, Cuts::FEW));
        if dissected.work < 0.97 * tree.work { dissected } else { tree }
    }
}

impl Symbolic {
    /// Analyses a symmetric pattern of blocks; `adjacency` has neither self loops nor repetition.
    pub(crate) fn new(dims: &[usize], adjacency: &[Vec<u32>], ordering: Ordering) -> Self {
        let tree = match ordering {
            Ordering::LeastWork => Tree::of_least_work(adjacency),
            Ordering::ShortPaths => Tree::new(adjacency, &dissection::order(adjacency, Cuts::MANY)),
        };
        let Tree { order, parent, counts, .. } = tree;
        let sizes: Vec<usize> = order.iter().map(|&i| dims[i as usize]).collect();
        let groups = supernodes::amalgamate(&parent, &counts, &sizes);
        let groups = sort_groups(&parent, &counts, groups);
        Self::from_groups(dims, adjacency, &order, groups)
    }

    fn from_groups(dims: &[usize], adjacency: &[Vec<u32>], order: &[u32], groups: Vec<Vec<u32>>) -> Self {
        let columns: Vec<u32> = groups.iter().flatten().copied().collect();
        let order = compose(order, &columns);
        let mut out = Self { position: vec![0; order.len()], ..Self::default() };
        out.offsets.push(0);
        for (k, &i) in order.iter().enumerate() {
            out.position[i as usize] = k as u32;
            out.dims.push(dims[i as usize]);
            out.offsets.push(out.offsets[k] + dims[i as usize]);
        }
        let mut first = 0;
        for (s, group) in groups.iter().enumerate() {
            let columns = group.len() as u32;
            out.node_of.extend(std::iter::repeat_n(s as u32, group.len()));
            out.nodes.push(Node { first, columns, parent: ROOT, ..Node::default() });
            first += columns;
        }
        out.order = order;
        out.fill_rows(adjacency);
        out.place();
        out
    }

    /// Rows below every supernode: original entries and what the children pass up.
    fn fill_rows(&mut self, adjacency: &[Vec<u32>]) {
        let mut mark = vec![ROOT; self.order.len()];
        for s in 0..self.nodes.len() {
            let (first, end) = (self.nodes[s].first, self.nodes[s].first + self.nodes[s].columns);
            let mut rows = Vec::new();
            let mut add = |row: u32, rows: &mut Vec<u32>| {
                if row >= end && mark[row as usize] != s as u32 {
                    mark[row as usize] = s as u32;
                    rows.push(row);
                }
            };
            for k in first..end {
                for &j in &adjacency[self.order[k as usize] as usize] {
                    add(self.position[j as usize], &mut rows);
                }
            }
            for c in 0..self.nodes[s].children.len() {
                let c = self.nodes[s].children[c] as usize;
                for &row in &self.nodes[c].rows {
                    add(row, &mut rows);
                }
            }
            rows.sort_unstable();
            if let Some(&row) = rows.first() {
                let p = self.node_of[row as usize];
                self.nodes[s].parent = p;
                self.nodes[p as usize].children.push(s as u32);
            }
            self.nodes[s].rows = rows;
        }
    }

    /// Shapes, places in memory and the maps from child to parent.
    fn place(&mut self) {
        for s in 0..self.nodes.len() {
            let node = &self.nodes[s];
            let end = (node.first + node.columns) as usize;
            let pivots = self.offsets[end] - self.offsets[node.first as usize];
            let below = node.rows.iter().map(|&r| self.dims[r as usize]).sum();
            let first_descendant =
                node.children.first().map_or(s as u32, |&c| self.nodes[c as usize].first_descendant);
            let shape = Shape { pivots, below };
            self.nodes[s].work_before = self.flops;
            let (n, m) = (pivots as f64, below as f64);
            self.flops += n * n * n / 6.0 + n * n * m / 2.0 + n * m * m / 2.0;
            let node = &mut self.nodes[s];
            (node.shape, node.first_descendant, node.panel) = (shape, first_descendant, self.factor_len);
            self.factor_len += shape.len();
        }
        for s in (0..self.nodes.len()).rev() {
            let parent = self.nodes[s].parent;
            if parent != ROOT {
                self.nodes[s].depth = self.nodes[parent as usize].depth + 1;
                self.nodes[s].runs = self.runs(s, parent as usize);
            }
        }
    }

    fn runs(&self, s: usize, p: usize) -> Vec<Run> {
        let parent = &self.nodes[p];
        let pivot_end = parent.first + parent.columns;
        let start = self.offsets[parent.first as usize];
        let (mut at, mut row_start) = (0, parent.shape.below_start());
        let mut runs: Vec<Run> = Vec::new();
        let mut child = 0_u32;
        for &row in &self.nodes[s].rows {
            let place = if row < pivot_end {
                self.offsets[row as usize] - start
            } else {
                while at < parent.rows.len() && parent.rows[at] < row {
                    row_start += self.dims[parent.rows[at] as usize];
                    at += 1;
                }
                row_start
            };
            let len = self.dims[row as usize] as u32;
            match runs.last_mut() {
                // A run never crosses from pivots to rows below, even where no padding separates them.
                Some(r)
                    if r.parent + r.len == place as u32
                        && (place != parent.shape.below_start() || place < parent.shape.pivots) =>
                {
                    r.len += len;
                }
                _ => runs.push(Run { child, parent: place as u32, len }),
            }
            child += len;
        }
        runs
    }

    /// Scalars of the columns of a supernode, elimination order.
    pub(crate) fn pivots(&self, node: &Node) -> std::ops::Range<usize> {
        let start = self.offsets[node.first as usize];
        start..start + node.shape.pivots
    }

    /// First scalar in the factor, and leading dimension, of the block (row, column), row ≥ column, positions both.
    /// `None` off the pattern of L.
    pub(crate) fn block_in_factor(&self, row: u32, column: u32) -> Option<(usize, usize)> {
        let node = &self.nodes[self.node_of[column as usize] as usize];
        let first = self.offsets[node.first as usize];
        let start = if row < node.first + node.columns {
            self.offsets[row as usize] - first
        } else {
            let at = node.rows.binary_search(&row).ok()?;
            let above: usize = node.rows[..at].iter().map(|&r| self.dims[r as usize]).sum();
            node.shape.below_start() + above
        };
        let ld = node.shape.ld();
        Some((node.panel + (self.offsets[column as usize] - first) * ld + start, ld))
    }

    /// First scalar of a variable, by position, within the front of `node`: pivots, then rows below, without padding. `None` outside the front.
    pub(crate) fn place_in_front(&self, node: &Node, position: u32) -> Option<usize> {
        if (node.first..node.first + node.columns).contains(&position) {
            return Some(self.offsets[position as usize] - self.offsets[node.first as usize]);
        }
        let at = node.rows.binary_search(&position).ok()?;
        let above: usize = node.rows[..at].iter().map(|&r| self.dims[r as usize]).sum();
        Some(node.shape.pivots + above)
    }

    /// The lowest supernode whose subtree holds both; `None` for different trees.
    pub(crate) fn lowest_above(&self, s: u32, t: u32) -> Option<u32> {
        let (low, high) = (s.min(t), s.max(t));
        let mut top = high;
        // Subtrees are ranges.
        while self.nodes[top as usize].first_descendant > low {
            top = self.nodes[top as usize].parent;
            if top == ROOT {
                return None;
            }
        }
        Some(top)
    }

    /// Scalars in all.
    pub(crate) fn len(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }
}

fn compose(outer: &[u32], inner: &[u32]) -> Vec<u32> {
    inner.iter().map(|&k| outer[k as usize]).collect()
}

/// Brings groups, children before parents, into a postorder of their tree, so that every subtree is a range.
fn sort_groups(parent: &[u32], counts: &[u32], groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let mut group_of = vec![0_u32; parent.len()];
    for (g, columns) in groups.iter().enumerate() {
        for &k in columns {
            group_of[k as usize] = g as u32;
        }
    }
    // The last column of a group is its top: its parent lies outside.
    let top = |columns: &Vec<u32>| columns.last().map_or(0, |&k| k as usize);
    let above = |columns| match parent[top(columns)] {
        ROOT => ROOT,
        p => group_of[p as usize],
    };
    let above: Vec<u32> = groups.iter().map(above).collect();
    // Blocks of the Schur complement.
    let size: Vec<usize> = groups.iter().map(|columns| (counts[top(columns)] as usize - 1).pow(2)).collect();
    let mut groups: Vec<Option<Vec<u32>>> = groups.into_iter().map(Some).collect();
    let order = tree::postorder_for_stack(&above, &size);
    order.into_iter().filter_map(|g| groups[g as usize].take()).collect()
}
