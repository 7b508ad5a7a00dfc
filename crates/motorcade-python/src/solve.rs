//! A solve of a pose graph.

use std::sync::{Arc, Mutex};

use motorcade::Progress;
use motorcade_graph::solver::Control;
use motorcade_graph::start::Start;
use motorcade_graph::{Options, Report};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{Error, Failure};
use crate::named_graph::NamedGraph;
use crate::supervise::supervised;

/// As the command line's: more are a slip of the finger, and starting them takes minutes.
const MOST_THREADS: usize = 1024;

/// A solve that is asked for.
pub struct Request {
    pub start: Start,
    pub options: Options,
}

impl Request {
    /// Solves on a thread of its own; the report as a dictionary.
    pub fn solve<'py>(
        self,
        py: Python<'py>,
        graph: Arc<Mutex<NamedGraph>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if self.options.threads > MOST_THREADS {
            return Err(Failure::settings(format!("threads must lie in [0, {MOST_THREADS}]")).into());
        }
        let report = supervised(py, progress, move |watch| {
            watch.begin("graph", Some(self.options.max_iterations));
            let control = Control { cancel: Some(watch.stop()), progress: Some(watch.iterations()) };
            let mut graph =
                graph.lock().map_err(|_| Error::new_err("this graph failed in an earlier call"))?;
            graph.optimise(self.start, self.options, &control)
        })?;
        dictionary(py, &report)
    }
}

fn dictionary<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let termination = serde_json::to_value(report.termination).ok();
    out.set_item("termination", termination.as_ref().and_then(|name| name.as_str()))?;
    out.set_item("converged", report.converged())?;
    out.set_item("iterations", report.iterations.len())?;
    out.set_item("initial_cost", report.initial_cost)?;
    out.set_item("final_cost", report.final_cost)?;
    out.set_item("unknowns", report.unknowns)?;
    Ok(out)
}
