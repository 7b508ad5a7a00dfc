//! Pose graphs.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use motorcade_graph::factors::PoseResidual;
use motorcade_graph::{Options, RobustKernel, Value};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Square};
use crate::drive::write_file;
use crate::errors::{Error, Failure};
use crate::marginals::Marginals;
use crate::named_graph::NamedGraph;
use crate::solve::Request;

/// A sparse pose graph of SE(3) or SE(2) poses: add vertices and edges, optimise, ask for covariances.
///
/// Poses are homogeneous matrices `world_from_body`, shape [4, 4] (SE(3)) or [3, 3] (SE(2)). An edge is a measured motion
/// `first_from_second` with an information matrix (inverse covariance) of shape [6, 6], order `[ω, ν]` (rotation first, then
/// translation, in the frame of the second body), or [3, 3], order `[θ, x, y]`. g2o files have the other order; `read` and
/// `write` convert.
///
/// >>> graph = motorcade.PoseGraph()
/// >>> graph.add_vertex(0, numpy.eye(4), fixed=True)
/// >>> graph.add_vertex(1, numpy.eye(4))
/// >>> graph.add_edge(0, 1, motion, 100 * numpy.eye(6))
/// >>> graph.optimise()["final_cost"]
#[pyclass(frozen, module = "motorcade")]
pub struct PoseGraph {
    graph: Arc<Mutex<NamedGraph>>,
}

impl PoseGraph {
    fn of(graph: NamedGraph) -> Self {
        Self { graph: Arc::new(Mutex::new(graph)) }
    }

    fn lock(&self) -> Result<MutexGuard<'_, NamedGraph>, Failure> {
        match self.graph.try_lock() {
            Ok(graph) => Ok(graph),
            Err(TryLockError::WouldBlock) => {
                Err(Error::new_err("this graph is being optimised by another call").into())
            }
            Err(TryLockError::Poisoned(_)) => {
                Err(Error::new_err("this graph failed in an earlier call").into())
            }
        }
    }
}

fn kernel(text: Option<&str>) -> Result<RobustKernel, Failure> {
    match text {
        None => Ok(RobustKernel::default()),
        Some(text) => text.parse().map_err(|e| Failure::settings(format!("robust: {e}"))),
    }
}

#[pymethods]
impl PoseGraph {
    /// A graph without anything.
    #[new]
    fn new() -> Self {
        Self::of(NamedGraph::default())
    }

    /// Reads a g2o file. `robust` is a kernel of all edges, such as "cauchy:1.0"; `cost` is "log" or "mqt" (g2o's residual).
    #[staticmethod]
    #[pyo3(signature = (path, *, robust=None, cost="log"))]
    fn read(py: Python<'_>, path: PathBuf, robust: Option<&str>, cost: &str) -> Result<Self, Failure> {
        let (residual, kernel) = (cost.parse::<PoseResidual>()?, kernel(robust)?);
        Ok(Self::of(py.detach(|| NamedGraph::read(&path, residual, kernel))?))
    }

    /// Writes a g2o file; one that is there is replaced with `force=True` only.
    #[pyo3(signature = (path, *, force=false))]
    fn write(&self, path: PathBuf, force: bool) -> Result<(), Failure> {
        write_file(&path, self.lock()?.text().as_bytes(), force)
    }

    /// The graph as the text of a g2o file.
    fn to_g2o(&self) -> Result<String, Failure> {
        Ok(self.lock()?.text())
    }

    /// Adds a vertex with its starting pose, shape [4, 4] or [3, 3]; `fixed` holds it there.
    #[pyo3(signature = (id, pose, *, fixed=false))]
    fn add_vertex(&self, id: u64, pose: PyReadonlyArray2<'_, f64>, fixed: bool) -> Result<(), Failure> {
        self.lock()?.add_vertex(id, &Square::read("pose", &pose)?, fixed)
    }

    /// Adds an edge: the motion `first_from_second` and its information matrix. `robust` is a kernel with its scale in standard
    /// deviations, such as "huber:2" or "cauchy:3.5"; `cost` is "log" or "mqt" (g2o's residual).
    #[pyo3(signature = (first, second, motion, information, *, robust=None, cost="log"))]
    fn add_edge(
        &self,
        first: u64,
        second: u64,
        motion: PyReadonlyArray2<'_, f64>,
        information: PyReadonlyArray2<'_, f64>,
        robust: Option<&str>,
        cost: &str,
    ) -> Result<(), Failure> {
        let (motion, information) =
            (Square::read("motion", &motion)?, Square::read("information", &information)?);
        let (kernel, residual) = (kernel(robust)?, cost.parse::<PoseResidual>()?);
        self.lock()?.add_edge([first, second], &motion, &information, kernel, residual)
    }

    /// Holds a vertex at its pose.
    fn fix(&self, id: u64) -> Result<(), Failure> {
        let mut graph = self.lock()?;
        let variable = graph.variable(id)?;
        Ok(graph.graph.fix(variable)?)
    }

    /// Lets a vertex move again.
    fn release(&self, id: u64) -> Result<(), Failure> {
        let mut graph = self.lock()?;
        let variable = graph.variable(id)?;
        graph.graph.release(variable);
        Ok(())
    }

    /// Numbers of all vertices, increasing.
    #[getter]
    fn ids(&self) -> Result<Vec<u64>, Failure> {
        Ok(self.lock()?.vertices.keys().copied().collect())
    }

    /// Number of edges.
    #[getter]
    fn edge_count(&self) -> Result<usize, Failure> {
        Ok(self.lock()?.graph.factors().len())
    }

    fn __len__(&self) -> Result<usize, Failure> {
        Ok(self.lock()?.vertices.len())
    }

    fn __repr__(&self) -> Result<String, Failure> {
        let graph = self.lock()?;
        Ok(format!("PoseGraph({} vertices, {} edges)", graph.vertices.len(), graph.graph.factors().len()))
    }

    /// Pose of a vertex, shape [4, 4] or [3, 3].
    fn pose(&self, py: Python<'_>, id: u64) -> Result<Py<PyArray2<f64>>, Failure> {
        let graph = self.lock()?;
        let matrix = match graph.graph.values().value(graph.variable(id)?)? {
            Value::Se3(pose) => pose.to_homogeneous().as_slice().to_vec(),
            Value::Se2(pose) => pose.to_homogeneous().as_slice().to_vec(),
            _ => return Err(Failure::input(format!("vertex {id} is no pose"))),
        };
        let side = if matrix.len() == 16 { 4 } else { 3 };
        Ok(arrays::single(py, &nalgebra::DMatrix::from_vec(side, side, matrix))?)
    }

    /// Cost Σ ρ(rᵀ Ω r) at the present poses; χ² without robust kernels.
    fn cost(&self) -> Result<f64, Failure> {
        Ok(self.lock()?.graph.cost()?)
    }

    /// Moves the vertices to the least cost. A component without a fixed vertex is held at its first one meanwhile.
    ///
    /// `method` is "lm", "gn" or "dogleg"; `start` "auto", "file" (the present poses), "spanning-tree" or "chordal"; `threads` 0
    /// takes all cores, results do not depend on it. `progress(stage, iterations, total)` is called after iterations; Ctrl-C stops after the present
    /// one and keeps the best poses so far. Returns a dictionary: `termination`, `converged`, `iterations`, `initial_cost`,
    /// `final_cost`, `unknowns`.
    #[expect(clippy::too_many_arguments, reason = "each has a name in Python")]
    #[pyo3(signature = (*, method="lm", start="auto", iterations=100, threads=1, time_limit_s=None, progress=None))]
    fn optimise<'py>(
        &self,
        py: Python<'py>,
        method: &str,
        start: &str,
        iterations: usize,
        threads: usize,
        time_limit_s: Option<f64>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let method = method.parse().map_err(Failure::from)?;
        let options =
            Options { method, max_iterations: iterations, threads, time_limit_s, ..Default::default() };
        let request = Request { start: start.parse().map_err(Failure::from)?, options };
        drop(self.lock()?);
        request.solve(py, Arc::clone(&self.graph), progress.as_ref())
    }

    /// Covariances at the present poses, best after `optimise`. Every component needs a fixed vertex.
    fn marginals(&self, py: Python<'_>) -> PyResult<Marginals> {
        py.detach(|| {
            let graph = self.lock()?;
            Ok(Marginals::new(&graph)?)
        })
    }
}
