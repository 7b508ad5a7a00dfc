//! Relaxed supernodes: columns of (nearly) equal structure are eliminated together as one dense panel.

use crate::tree::ROOT;

/// A group of columns and the scalar size of what lies below them.
struct Group {
    columns: Vec<u32>,
    parent: u32,
    /// Scalar columns.
    pivots: usize,
    /// Scalar rows below.
    below: usize,
    /// Scalar zeros stored because of merging.
    zeros: usize,
}

impl Group {
    fn entries(&self) -> usize {
        self.pivots * (self.pivots + 1) / 2 + self.pivots * self.below
    }
}

/// Groups in an order where children come before parents; each lists its columns in elimination order.
pub(crate) fn amalgamate(parent: &[u32], counts: &[u32], dims: &[usize]) -> Vec<Vec<u32>> {
    let (mut groups, group_of) = fundamental(parent, counts, dims);
    // Scalar rows below a group, summed along the path is not possible from counts when sizes differ: counts are in
    // blocks, so scale by the mean size; it is exact when all variables have the same size.
    let mean = dims.iter().sum::<usize>() as f64 / dims.len().max(1) as f64;
    for (g, group) in groups.iter_mut().enumerate() {
        let Some(&last) = group.columns.last() else { continue };
        group.below = ((counts[last as usize] - 1) as f64 * mean).round() as usize;
        group.parent = match parent[last as usize] {
            ROOT => ROOT,
            p => group_of[p as usize],
        };
        debug_assert!(group.parent == ROOT || group.parent as usize > g);
    }
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
    for g in 0..groups.len() {
        // Children were finished before: try them largest first, which leaves the fewest zeros. The children of a
        // merged child become children here and get their turn.
        let mut queue = std::mem::take(&mut children[g]);
        let mut stay = Vec::new();
        while !queue.is_empty() {
            queue.sort_by_key(|&c| {
                let c = &groups[c as usize];
                (c.pivots + c.below, std::cmp::Reverse(c.columns.first().copied()))
            });
            let mut next = Vec::new();
            while let Some(c) = queue.pop() {
                if try_merge(&mut groups, c as usize, g) {
                    next.append(&mut children[c as usize]);
                } else {
                    stay.push(c);
                }
            }
            queue = next;
        }
        children[g] = stay;
        let p = groups[g].parent;
        if p != ROOT {
            children[p as usize].push(g as u32);
        }
    }
    groups.into_iter().map(|g| g.columns).filter(|c| !c.is_empty()).collect()
}

/// Chains of columns whose structures nest exactly.
fn fundamental(parent: &[u32], counts: &[u32], dims: &[usize]) -> (Vec<Group>, Vec<u32>) {
    let mut groups: Vec<Group> = Vec::new();
    let mut group_of = vec![0; parent.len()];
    for k in 0..parent.len() {
        let joins = k > 0 && parent[k - 1] == k as u32 && counts[k - 1] == counts[k] + 1;
        if !joins {
            groups.push(Group { columns: Vec::new(), parent: ROOT, pivots: 0, below: 0, zeros: 0 });
        }
        if let Some(group) = groups.last_mut() {
            group.columns.push(k as u32);
            group.pivots += dims[k];
        }
        group_of[k] = (groups.len() - 1) as u32;
    }
    (groups, group_of)
}

/// Merges a child into its parent where the zeros stored cost less than a separate front would.
fn try_merge(groups: &mut [Group], c: usize, p: usize) -> bool {
    let (child, top) = (&groups[c], &groups[p]);
    let front = top.pivots + top.below;
    let zeros = child.zeros + top.zeros + child.pivots * front.saturating_sub(child.below);
    let merged = Group {
        columns: Vec::new(),
        parent: top.parent,
        pivots: child.pivots + top.pivots,
        below: top.below,
        zeros,
    };
    let share = zeros as f64 / merged.entries() as f64;
    let limit = match merged.pivots {
        0..=18 => 0.2,
        19..=48 => 0.1,
        49..=96 => 0.05,
        _ => 0.02,
    };
    if share > limit {
        return false;
    }
    let mut columns = std::mem::take(&mut groups[c].columns);
    columns.append(&mut groups[p].columns);
    groups[p] = Group { columns, ..merged };
    true
}
