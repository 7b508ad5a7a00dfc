//! The SE(3) measurements of a graph, as a plain list.

use nalgebra::{Isometry3, Matrix6};

use crate::graph::Graph;
use crate::ids::VariableId;
use crate::manifold::Value;

/// One measurement `first_from_second` between positions in the list of poses.
pub(super) struct Edge {
    pub first: u32,
    pub second: u32,
    pub motion: Isometry3<f64>,
    pub information: Matrix6<f64>,
}

/// Poses joined by relative measurements.
pub(super) struct PoseNetwork {
    /// SE(3) variables, increasing.
    pub variables: Vec<VariableId>,
    pub poses: Vec<Isometry3<f64>>,
    /// Fixed ones, or the first pose of a component without any.
    pub anchored: Vec<bool>,
    pub edges: Vec<Edge>,
}

impl PoseNetwork {
    pub(super) fn new(graph: &Graph) -> Self {
        let (mut variables, mut poses) = (Vec::new(), Vec::new());
        for (id, value) in graph.values().iter() {
            if let Value::Se3(pose) = value {
                variables.push(id);
                poses.push(*pose);
            }
        }
        let mut edges = Vec::new();
        for (_, factor) in graph.factors() {
            let (Some(relative), [a, b]) = (factor.relative_pose(), factor.variables()) else { continue };
            let (Ok(a), Ok(b)) = (variables.binary_search(a), variables.binary_search(b)) else { continue };
            edges.push(Edge {
                first: a as u32,
                second: b as u32,
                motion: *relative.measurement,
                information: *relative.information,
            });
        }
        let mut out = Self { anchored: vec![false; poses.len()], variables, poses, edges };
        for (k, id) in out.variables.iter().enumerate() {
            out.anchored[k] = graph.is_fixed(*id);
        }
        out.anchor_the_rest();
        out
    }

    /// Edges at every pose.
    pub(super) fn incident(&self) -> Vec<Vec<u32>> {
        let mut near = vec![Vec::new(); self.poses.len()];
        for (e, edge) in self.edges.iter().enumerate() {
            near[edge.first as usize].push(e as u32);
            near[edge.second as usize].push(e as u32);
        }
        near
    }

    fn anchor_the_rest(&mut self) {
        let near = self.incident();
        let mut reached = self.anchored.clone();
        let mut stack: Vec<u32> = (0..self.poses.len() as u32).filter(|&k| reached[k as usize]).collect();
        for k in 0..self.poses.len() {
            while let Some(at) = stack.pop() {
                for &e in &near[at as usize] {
                    let edge = &self.edges[e as usize];
                    let other = if edge.first == at { edge.second } else { edge.first };
                    if !std::mem::replace(&mut reached[other as usize], true) {
                        stack.push(other);
                    }
                }
            }
            if !reached[k] {
                (reached[k], self.anchored[k]) = (true, true);
                stack.push(k as u32);
            }
        }
    }
}
