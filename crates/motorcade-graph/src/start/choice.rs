//! Choice of the starting values.

use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use serde::Serialize;

use motorcade_sparse::Stop;

use super::chordal::chordal_unless;
use super::spanning_tree;
use crate::GraphError;
use crate::graph::Graph;
use crate::solver::{Control, Iteration, Limits, Options, Report, Solver, Termination};
use crate::values::Values;

/// Starting values of an optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The file's vertices if every step from there lowers the cost at its first trial; else the one of the three below with
    /// the lowest cost after a few iterations.
    #[default]
    Auto,
    /// The file's vertices.
    File,
    /// Poses chained along the edges of most information.
    SpanningTree,
    /// The chordal solution.
    Chordal,
}

impl FromStr for Start {
    type Err = GraphError;
    fn from_str(s: &str) -> Result<Self, GraphError> {
        match s {
            "auto" => Ok(Self::Auto),
            "file" => Ok(Self::File),
            "spanning-tree" => Ok(Self::SpanningTree),
            "chordal" => Ok(Self::Chordal),
            _ => {
                let reason = format!("{s:?} is none of auto, file, spanning-tree, chordal");
                Err(GraphError::Option { name: "init", reason })
            }
        }
    }
}

/// Iterations after which a start counts as poor. From a good one pose graphs need fewer than ten.
pub const MANY_ITERATIONS: usize = 30;

/// Iterations after which starts are compared.
const TRIAL: usize = 5;

/// Relative decrease of the cost from which on another start replaces the file's.
const BETTER: f64 = 1e-3;

/// Sets the values of `graph` to the start asked for and returns which it is; [`Start::Auto`] is resolved. `began` is when
/// the time limit of `options` began.
///
/// # Errors
/// A start that cannot be computed.
pub fn prepare(
    graph: &mut Graph,
    wanted: Start,
    options: &Options,
    control: &Control,
    began: Instant,
) -> Result<Start, GraphError> {
    match wanted {
        Start::Auto => return choose(graph, options, control, began),
        Start::File => {}
        Start::SpanningTree => spanning_tree(graph)?,
        Start::Chordal => {
            let limits = Limits::new(control, Stop::NEVER, options, began);
            let reached = || limits.reached().is_some();
            match chordal_unless(graph, Stop::new(&reached)) {
                // The solve that follows ends at once, with the values of the file.
                Err(GraphError::Stopped) => {}
                set => set?,
            }
        }
    }
    Ok(wanted)
}

/// Solves from the current values as long as every step is taken at its first trial and lowers the cost. At the first
/// that does not the solve is given up, the values are put back and `None` is returned.
///
/// # Errors
/// Options out of their range.
pub fn descend(
    graph: &mut Graph,
    options: &Options,
    control: &Control,
) -> Result<Option<Report>, GraphError> {
    let file = graph.values().clone();
    let stumbled = Arc::new(AtomicBool::new(false));
    let (seen, asked) = (Arc::clone(&stumbled), control.progress.clone());
    let before = Mutex::new(f64::INFINITY);
    let watch = move |row: &Iteration| {
        let last = before.lock().map_or(f64::INFINITY, |mut x| std::mem::replace(&mut *x, row.cost));
        if row.trials > 1 || row.cost > last || row.iteration >= MANY_ITERATIONS {
            seen.store(true, Ordering::Relaxed);
        }
        if let Some(progress) = &asked {
            progress(row);
        }
    };
    let control = Control { progress: Some(Arc::new(watch)), ..control.clone() };
    let has_stumbled = || stumbled.load(Ordering::Relaxed);
    let mut solver = Solver::new(options.clone())?.with_control(control);
    if let Ok(report) = solver.optimise_unless(graph, Stop::new(&has_stumbled))
        && !has_stumbled()
        && report.termination != Termination::Stalled
    {
        return Ok(Some(report));
    }
    *graph.values_mut() = file;
    Ok(None)
}

/// A trial of a start.
struct Tried {
    start: Start,
    /// Cost after the trial.
    cost: f64,
    /// Values before and after the trial.
    values: [Values; 2],
}

/// Tries every start for a few iterations and returns to the best one. When the time is over or the solve is cancelled, the
/// values reached from the best of those tried so far are kept.
fn choose(
    graph: &mut Graph,
    options: &Options,
    control: &Control,
    began: Instant,
) -> Result<Start, GraphError> {
    let file = graph.values().clone();
    let over = || control.cancelled() || options.out_of_time(began);
    let short = Options { max_iterations: TRIAL.min(options.max_iterations), ..options.clone() };
    let mut solver = Solver::new(short)?.with_control(Control { progress: None, ..control.clone() });
    let mut best: Option<Tried> = None;
    for start in [Start::File, Start::Chordal, Start::SpanningTree] {
        if best.is_some() && over() {
            break;
        }
        *graph.values_mut() = file.clone();
        // A start that cannot be computed or solved from is left out.
        let made = prepare(graph, start, options, control, began).is_ok();
        if !made || (start != Start::File && *graph.values() == file) {
            continue;
        }
        let values = graph.values().clone();
        solver.set_time_limit_s(options.remaining(began).time_limit_s);
        let cost = solver.optimise(graph).map_or(f64::INFINITY, |report| report.final_cost);
        if best.as_ref().is_none_or(|b| cost < (1.0 - BETTER) * b.cost) {
            best = Some(Tried { start, cost, values: [values, graph.values().clone()] });
        }
    }
    let Some(Tried { start, values: [begun, led], .. }) = best else { return Ok(Start::File) };
    *graph.values_mut() = if over() { led } else { begun };
    Ok(start)
}
