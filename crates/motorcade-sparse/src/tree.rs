//! Elimination tree, postorder and column counts of a pattern already in elimination order.

pub(crate) const ROOT: u32 = u32::MAX;

/// For every column its neighbours with a smaller position, columns in elimination order.
pub(crate) struct Upper {
    /// Start of every column in `rows`; one more at the end.
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl Upper {
    pub(crate) fn new(adjacency: &[Vec<u32>], order: &[u32]) -> Self {
        let mut position = vec![0_u32; order.len()];
        for (k, &i) in order.iter().enumerate() {
            position[i as usize] = k as u32;
        }
        let entries: usize = adjacency.iter().map(Vec::len).sum();
        let mut out =
            Self { starts: Vec::with_capacity(order.len() + 1), rows: Vec::with_capacity(entries / 2) };
        out.starts.push(0);
        for (k, &i) in order.iter().enumerate() {
            let near = adjacency[i as usize].iter().map(|&j| position[j as usize]);
            out.rows.extend(near.filter(|&j| (j as usize) < k));
            out.starts.push(out.rows.len() as u32);
        }
        out
    }

    fn columns(&self) -> usize {
        self.starts.len() - 1
    }

    fn column(&self, k: usize) -> &[u32] {
        &self.rows[self.starts[k] as usize..self.starts[k + 1] as usize]
    }
}

/// Parent of every column (Liu's algorithm with path compression).
pub(crate) fn elimination_tree(upper: &Upper) -> Vec<u32> {
    let n = upper.columns();
    let (mut parent, mut ancestor) = (vec![ROOT; n], vec![ROOT; n]);
    for k in 0..n {
        for &start in upper.column(k) {
            let mut i = start as usize;
            while i < k {
                let next = ancestor[i];
                ancestor[i] = k as u32;
                if next == ROOT {
                    parent[i] = k as u32;
                    break;
                }
                i = next as usize;
            }
        }
    }
    parent
}

/// Postorder of a forest given by parents; children are visited in increasing order.
pub(crate) fn postorder(parent: &[u32]) -> Vec<u32> {
    Forest::new(parent).postorder()
}

/// Postorder of a forest whose children come before their parents, for a multifrontal elimination with short stacks:
/// of the children of a node those come first that need much to leave little (Liu, *On the storage requirement in the
/// out-of-core multifrontal method*, ACM TOMS 12, 1986). `size` is what a node leaves on the stack for its parent.
pub(crate) fn postorder_for_stack(parent: &[u32], size: &[usize]) -> Vec<u32> {
    let mut forest = Forest::new(parent);
    let mut need = vec![0; parent.len()];
    let mut children = Vec::new();
    for g in 0..parent.len() {
        children.clear();
        let mut child = forest.head[g];
        while child != ROOT {
            children.push(child);
            child = forest.next[child as usize];
        }
        children.sort_by_key(|&c| size[c as usize] as isize - need[c as usize] as isize);
        let (mut held, mut most) = (0, 0);
        for &c in &children {
            most = most.max(held + need[c as usize]);
            held += size[c as usize];
        }
        need[g] = most.max(held + size[g]);
        forest.head[g] = children.first().copied().unwrap_or(ROOT);
        for (k, &c) in children.iter().enumerate() {
            forest.next[c as usize] = children.get(k + 1).copied().unwrap_or(ROOT);
        }
    }
    forest.postorder()
}

/// Children of every node as linked lists.
struct Forest {
    head: Vec<u32>,
    next: Vec<u32>,
    /// Decreasing.
    roots: Vec<u32>,
}

impl Forest {
    fn new(parent: &[u32]) -> Self {
        let n = parent.len();
        let mut out = Self { head: vec![ROOT; n], next: vec![ROOT; n], roots: Vec::new() };
        for i in (0..n).rev() {
            match parent[i] {
                ROOT => out.roots.push(i as u32),
                p => {
                    out.next[i] = out.head[p as usize];
                    out.head[p as usize] = i as u32;
                }
            }
        }
        out
    }

    fn postorder(mut self) -> Vec<u32> {
        let (mut out, mut stack) = (Vec::with_capacity(self.head.len()), Vec::new());
        while let Some(root) = self.roots.pop() {
            stack.push(root);
            while let Some(&node) = stack.last() {
                let child = self.head[node as usize];
                if child == ROOT {
                    out.push(node);
                    stack.pop();
                } else {
                    self.head[node as usize] = self.next[child as usize];
                    stack.push(child);
                }
            }
        }
        out
    }
}

/// Entries of every column of the factor, the diagonal included.
pub(crate) fn column_counts(upper: &Upper, parent: &[u32]) -> Vec<u32> {
    let n = upper.columns();
    let (mut counts, mut mark) = (vec![1_u32; n], vec![ROOT; n]);
    for k in 0..n {
        mark[k] = k as u32;
        for &start in upper.column(k) {
            let mut i = start as usize;
            while mark[i] != k as u32 {
                mark[i] = k as u32;
                counts[i] += 1;
                i = parent[i] as usize;
            }
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Most that lies on the stack while a forest is eliminated in this order.
    fn stack(order: &[u32], parent: &[u32], size: &[usize]) -> usize {
        let (mut held, mut most) = (0, 0);
        for &g in order {
            held += size[g as usize];
            most = most.max(held);
            held -= (0..parent.len()).filter(|&c| parent[c] == g).map(|c| size[c]).sum::<usize>();
        }
        most
    }

    #[test]
    fn a_long_chain_with_leaves_needs_a_short_stack() {
        // First the leaves, two for each link of the chain, as minimum degree numbers them.
        let n = 300_u32;
        let above = |g: u32| if g < 200 { 200 + g / 2 } else { g + 1 };
        let parent: Vec<u32> = (0..n).map(|g| if g + 1 == n { ROOT } else { above(g) }).collect();
        let size = vec![9; n as usize];
        let order = postorder_for_stack(&parent, &size);
        let mut place = vec![0; n as usize];
        for (k, &g) in order.iter().enumerate() {
            place[g as usize] = k;
        }
        assert!((0..n as usize).all(|g| parent[g] == ROOT || place[g] < place[parent[g] as usize]));
        assert_eq!(order.len(), n as usize);
        let (ours, plain) = (stack(&order, &parent, &size), stack(&postorder(&parent), &parent, &size));
        assert!(ours <= 4 * 9 && plain > 100 * 9, "{ours} {plain}");
    }
}
