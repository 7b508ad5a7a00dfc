//! Elimination tree, postorder and column counts of a pattern already in elimination order.

pub(crate) const ROOT: u32 = u32::MAX;

/// For every column its neighbours with a smaller position (the upper pattern), columns in elimination order.
pub(crate) fn upper_pattern(adjacency: &[Vec<u32>], order: &[u32]) -> Vec<Vec<u32>> {
    let mut position = vec![0_u32; order.len()];
    for (k, &i) in order.iter().enumerate() {
        position[i as usize] = k as u32;
    }
    order
        .iter()
        .enumerate()
        .map(|(k, &i)| {
            let near = adjacency[i as usize].iter().map(|&j| position[j as usize]);
            near.filter(|&j| (j as usize) < k).collect()
        })
        .collect()
}

/// Parent of every column (Liu's algorithm with path compression).
pub(crate) fn elimination_tree(upper: &[Vec<u32>]) -> Vec<u32> {
    let n = upper.len();
    let (mut parent, mut ancestor) = (vec![ROOT; n], vec![ROOT; n]);
    for k in 0..n {
        for &start in &upper[k] {
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
    let n = parent.len();
    let (mut head, mut next) = (vec![ROOT; n], vec![ROOT; n]);
    let mut roots = Vec::new();
    for i in (0..n).rev() {
        match parent[i] {
            ROOT => roots.push(i as u32),
            p => {
                next[i] = head[p as usize];
                head[p as usize] = i as u32;
            }
        }
    }
    let (mut out, mut stack) = (Vec::with_capacity(n), Vec::new());
    while let Some(root) = roots.pop() {
        stack.push(root);
        while let Some(&node) = stack.last() {
            let child = head[node as usize];
            if child == ROOT {
                out.push(node);
                stack.pop();
            } else {
                head[node as usize] = next[child as usize];
                stack.push(child);
            }
        }
    }
    out
}

/// Entries of every column of the factor, the diagonal included.
pub(crate) fn column_counts(upper: &[Vec<u32>], parent: &[u32]) -> Vec<u32> {
    let n = upper.len();
    let (mut counts, mut mark) = (vec![1_u32; n], vec![ROOT; n]);
    for k in 0..n {
        mark[k] = k as u32;
        for &start in &upper[k] {
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
