//! Poses chained along the surest measurements.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use super::edges::PoseNetwork;
use crate::GraphError;
use crate::graph::Graph;

/// A pose and the summed uncertainty of its path.
#[derive(PartialEq)]
struct Reached {
    uncertainty: f64,
    pose: u32,
    edge: u32,
}

impl Eq for Reached {}
impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |r: &Self| (r.pose, r.edge);
        self.uncertainty.total_cmp(&other.uncertainty).then(key(self).cmp(&key(other)))
    }
}

/// Sets every SE(3) variable that is not fixed by chaining measurements from the fixed ones (or the first of each
/// component), along the path of least summed `6 / tr Ω` (Dijkstra).
pub fn spanning_tree(graph: &mut Graph) -> Result<(), GraphError> {
    let mut network = PoseNetwork::new(graph);
    let near = network.incident();
    let mut done = vec![false; network.poses.len()];
    let none = u32::MAX;
    let mut heap: BinaryHeap<Reverse<Reached>> = (0..network.poses.len())
        .filter(|&k| network.anchored[k])
        .map(|k| Reverse(Reached { uncertainty: 0.0, pose: k as u32, edge: none }))
        .collect();
    while let Some(Reverse(at)) = heap.pop() {
        let here = at.pose as usize;
        if std::mem::replace(&mut done[here], true) {
            continue;
        }
        if at.edge != none {
            let edge = &network.edges[at.edge as usize];
            network.poses[here] = if edge.second == at.pose {
                network.poses[edge.first as usize] * edge.motion
            } else {
                network.poses[edge.second as usize] * edge.motion.inverse()
            };
        }
        for &e in &near[here] {
            let edge = &network.edges[e as usize];
            let other = if edge.first == at.pose { edge.second } else { edge.first };
            if !done[other as usize] {
                let uncertainty = at.uncertainty + 6.0 / edge.information.trace().max(1e-12);
                heap.push(Reverse(Reached { uncertainty, pose: other, edge: e }));
            }
        }
    }
    for (&id, &pose) in network.variables.iter().zip(&network.poses) {
        if !graph.is_fixed(id) {
            graph.values_mut().set(id, pose)?;
        }
    }
    Ok(())
}
