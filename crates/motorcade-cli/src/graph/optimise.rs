//! `graph optimise`.

use std::path::PathBuf;
use std::time::Instant;

use cpu_time::ProcessTime;
use serde::Serialize;

use crate::arguments::KernelChoice;
use crate::files::lossy;
use motorcade_graph::factors::PoseResidual;
use motorcade_graph::g2o::{self, ReadOptions, ReadSummary};
use motorcade_graph::solver::{
    Control, GraduateOptions, Iteration, Options, Report, Solver, Termination, Timings, graduate,
};
use motorcade_graph::start::{self, Start};
use motorcade_graph::{FactorId, Graph, GraphError, GroupId};

/// Request.
#[derive(Clone, Debug, Default)]
pub struct OptimiseRequest {
    /// The graph.
    pub input: PathBuf,
    /// Method, limits, threads. The time limit is for the whole call, reading and the choice of a start included, and is
    /// looked at between iterations and within long factorisations.
    pub options: Options,
    /// Residual of SE(3) edges.
    pub cost: PoseResidual,
    /// Kernel of every edge.
    pub robust: Option<KernelChoice>,
    /// Starting values.
    pub init: Start,
    /// Cancellation and progress.
    pub control: Control,
}

/// Report.
#[derive(Clone, Debug, Serialize)]
pub struct OptimiseReport {
    /// The input file.
    #[serde(serialize_with = "lossy")]
    pub input: PathBuf,
    /// Findings while reading it.
    pub read: ReadSummary,
    /// Residual definition of all costs here.
    pub cost: PoseResidual,
    /// Kernel of every edge.
    pub robust: Option<KernelChoice>,
    /// Starting values; where `auto` was asked for, those it chose.
    pub init: Start,
    /// The options.
    pub options: Options,
    /// Connected components.
    pub components: usize,
    /// File ids of vertices held to fix components that nothing else held.
    pub anchors: Vec<u64>,
    /// Why it stopped.
    pub termination: Termination,
    /// Advice where the solve was slow or did not converge.
    pub hint: Option<&'static str>,
    /// CPU seconds of the optimisation alone, ordering included, reading, starting values and writing excluded.
    pub optimise_s: f64,
    /// CPU seconds of the starting values, trials included, and of a solve from the file that was given up.
    pub init_s: f64,
    /// Linearisations (with graduated non-convexity those of the last round).
    pub iterations: usize,
    /// Cost at the file's vertices.
    pub file_cost: f64,
    /// Cost where the optimisation started.
    pub initial_cost: f64,
    /// Cost at the end.
    pub final_cost: f64,
    /// Lower bound of the condition number.
    pub condition: f64,
    /// Wall-clock seconds by kind of work.
    pub timings: Timings,
    /// One row for each linearisation.
    pub rows: Vec<Iteration>,
}

/// Reads and optimises a graph: a report and the optimised graph as the text of a g2o file.
pub fn optimise(request: &OptimiseRequest) -> Result<(OptimiseReport, String), GraphError> {
    request.options.validate()?;
    let began = Instant::now();
    let kernel = request.robust.map_or_else(Default::default, KernelChoice::kernel);
    let mut document = g2o::read(&request.input, &ReadOptions { residual: request.cost, kernel })?;
    let graph = &mut document.graph;
    let components = graph.components().len();
    let anchors = graph.anchor_components()?;
    let file_cost = graph.cost()?;
    let clock = ProcessTime::now();
    let smooth = match (request.init, request.robust) {
        (_, Some(KernelChoice::Graduated(_))) => None,
        (Start::Auto, _) => start::descend(graph, &request.options.remaining(began), &request.control)?,
        _ => None,
    };
    let (init, init_s, optimise_s, report) = match smooth {
        Some(report) => (Start::File, 0.0, clock.elapsed().as_secs_f64(), report),
        None => {
            let init = start::prepare(graph, request.init, &request.options, &request.control, began)?;
            let init_s = clock.elapsed().as_secs_f64();
            let (clock, options) = (ProcessTime::now(), request.options.remaining(began));
            let report = match request.robust {
                Some(KernelChoice::Graduated(c)) => {
                    let group = group_of_all(graph)?;
                    let schedule = GraduateOptions { c, ..GraduateOptions::default() };
                    graduate(graph, group, &options, &schedule, &request.control)?
                }
                _ => {
                    let solver = Solver::new(options)?;
                    solver.with_control(request.control.clone()).optimise(graph)?
                }
            };
            (init, init_s, clock.elapsed().as_secs_f64(), report)
        }
    };
    let anchors: Vec<u64> = document
        .vertices
        .iter()
        .filter(|(_, variable)| anchors.binary_search(variable).is_ok())
        .map(|(id, _)| *id)
        .collect();
    // The file's own FIX lines are kept, the anchors chosen here are not part of the graph.
    for &id in &anchors {
        if let Some(variable) = document.variable(id) {
            document.graph.release(variable);
        }
    }
    let text = g2o::to_string(&document.graph, &document.vertices);
    let report = OptimiseReport {
        input: request.input.clone(),
        read: document.summary,
        cost: request.cost,
        robust: request.robust,
        init,
        options: request.options.clone(),
        components,
        anchors,
        termination: report.termination,
        hint: hint(init, &report),
        optimise_s,
        init_s,
        iterations: report.iterations.len(),
        file_cost,
        initial_cost: report.initial_cost,
        final_cost: report.final_cost,
        condition: report.condition,
        timings: report.timings,
        rows: report.iterations,
    };
    Ok((report, text))
}

/// Puts all factors into one group.
fn group_of_all(graph: &mut Graph) -> Result<GroupId, GraphError> {
    let group = graph.add_group();
    let all: Vec<FactorId> = graph.factors().map(|(id, _)| id).collect();
    for id in all {
        graph.assign(id, group)?;
    }
    Ok(group)
}

/// A solve that crept along ends, as a rule, in a local minimum.
fn hint(init: Start, report: &Report) -> Option<&'static str> {
    let crept = report.iterations.len() >= start::MANY_ITERATIONS;
    let failed = matches!(report.termination, Termination::Iterations | Termination::Stalled);
    match init {
        _ if !crept && (!failed || report.iterations.is_empty()) => None,
        Start::Chordal => {
            Some("a poor fit from a chordal start: look for wrong edges, try --robust cauchy:3.55")
        }
        _ => Some("slow, perhaps a local minimum: compare the cost from --init chordal"),
    }
}
