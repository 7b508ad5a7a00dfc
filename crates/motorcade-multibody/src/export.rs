//! The graph as a plain pose graph, for files.

use std::collections::BTreeMap;

use motorcade_graph::factors::Between;
use motorcade_graph::{Graph, GraphError, VariableId};
use nalgebra::Isometry3;

use crate::graph::MultibodyGraph;

impl MultibodyGraph {
    /// The graph of poses alone, nodes in the order of [`nodes`](Self::nodes): scales at their values, no motion model, no
    /// kernels.
    ///
    /// # Errors
    /// None after an update: the edges are those of the graph.
    pub fn poses_alone(&self) -> Result<(Graph, Vec<VariableId>), GraphError> {
        let (mut out, source) = (Graph::new(), self.graph());
        let (values, nodes) = (source.values(), self.nodes());
        let mut ids = BTreeMap::new();
        for (_, id) in &nodes {
            let copy = out.add_variable(*values.get::<Isometry3<f64>>(*id)?);
            if source.is_fixed(*id) {
                out.fix(copy)?;
            }
            ids.insert(*id, copy);
        }
        let copy = |id: &VariableId| ids.get(id).copied().ok_or(GraphError::UnknownVariable(*id));
        // Keyframes of a kept map are no poses of this drive.
        let within = |a: &VariableId, b: &VariableId| ids.contains_key(a) && ids.contains_key(b);
        let mut edges = Vec::new();
        for (_, factor) in source.factors() {
            if let ([a, b], Some(relative)) = (factor.variables(), factor.relative_pose())
                && within(a, b)
            {
                edges.push(Between::new(copy(a)?, copy(b)?, *relative.measurement, *relative.information)?);
            }
        }
        for (id, factor) in source.factors() {
            if let ([a, b, ..], Some(relative)) = (factor.variables(), factor.relative_pose_at(values)?) {
                let variance = source.group(id).map_or(1.0, |group| source.scale(group).variance);
                let information = relative.information / variance;
                edges.push(Between::new(copy(a)?, copy(b)?, relative.measurement, information)?);
            }
        }
        for edge in edges {
            out.add_factor(edge)?;
        }
        let order = nodes.iter().map(|(_, id)| copy(id)).collect::<Result<_, _>>()?;
        Ok((out, order))
    }
}
