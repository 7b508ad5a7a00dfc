//! Covariances of a pose graph.

use std::collections::BTreeMap;

use motorcade_graph::VariableId;
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::Failure;
use crate::named_graph::NamedGraph;

/// Covariances of the vertices of a `PoseGraph`, as it was when they were asked for.
///
/// Tangents are `[ω, ν]` (rad, m), in the frame of the vertex itself; SE(2) has `[θ, x, y]`. Those of fixed vertices are zero.
#[pyclass(frozen, module = "motorcade")]
pub struct Marginals {
    marginals: motorcade_graph::Marginals,
    vertices: BTreeMap<u64, VariableId>,
}

impl Marginals {
    pub fn new(graph: &NamedGraph) -> Result<Self, Failure> {
        // Rounding can hide that the equations of a floating graph are singular.
        if graph.floats() {
            return Err(motorcade_graph::GraphError::Singular.into());
        }
        let marginals = motorcade_graph::Marginals::new(&graph.graph)?;
        Ok(Self { marginals, vertices: graph.vertices.clone() })
    }

    fn variable(&self, id: u64) -> Result<VariableId, Failure> {
        self.vertices.get(&id).copied().ok_or_else(|| Failure::input(format!("there is no vertex {id}")))
    }
}

#[pymethods]
impl Marginals {
    /// Covariance of a vertex, shape [6, 6] or [3, 3].
    fn covariance(&self, py: Python<'_>, id: u64) -> Result<Py<PyArray2<f64>>, Failure> {
        Ok(arrays::single(py, &self.marginals.covariance(self.variable(id)?)?)?)
    }

    /// Covariance between two vertices, shape [dof of first, dof of second].
    fn cross(&self, py: Python<'_>, first: u64, second: u64) -> Result<Py<PyArray2<f64>>, Failure> {
        let block = self.marginals.cross(self.variable(first)?, self.variable(second)?)?;
        Ok(arrays::single(py, &block)?)
    }

    /// Joint covariance of several vertices in the order given, shape [Σ dof, Σ dof].
    fn joint(&self, py: Python<'_>, ids: Vec<u64>) -> Result<Py<PyArray2<f64>>, Failure> {
        let variables = ids.into_iter().map(|id| self.variable(id)).collect::<Result<Vec<_>, _>>()?;
        Ok(arrays::single(py, &self.marginals.joint(&variables)?)?)
    }
}
