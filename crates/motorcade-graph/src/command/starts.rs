//! Where `graph optimise` starts.

use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use serde::Serialize;

use crate::GraphError;
use crate::graph::Graph;
use crate::solver::{Control, Iteration, Options, Report, Solver, Termination};
use crate::start;
use crate::values::Values;

/// Where the optimisation starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At the file's vertices while every step goes down at once; where one is refused, at the one of the three below
    /// from which a few iterations lead to the least cost.
    #[default]
    Auto,
    /// At the file's vertices.
    File,
    /// At poses chained along the surest edges.
    SpanningTree,
    /// At the chordal solution.
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
pub(super) const MANY_ITERATIONS: usize = 30;

/// Iterations after which starts are compared.
const TRIAL: usize = 5;

/// How much lower, as a fraction, the cost from another start must be to leave the file's.
const BETTER: f64 = 1e-3;

/// Moves `graph` to the start asked for and returns which it is. `start` is when the time limit of `options` began.
pub(super) fn begin(
    graph: &mut Graph,
    wanted: Start,
    options: &Options,
    control: &Control,
    start: Instant,
) -> Result<Start, GraphError> {
    match wanted {
        Start::Auto => return choose(graph, options, control, start),
        Start::File => {}
        Start::SpanningTree => start::spanning_tree(graph)?,
        Start::Chordal => start::chordal(graph)?,
    }
    Ok(wanted)
}

/// Solves from where `graph` stands as long as all goes well: every step is taken at its first trial and lowers the cost.
/// At the first that does not the solve is given up, the values are put back and nothing is returned.
pub(super) fn smoothly(
    graph: &mut Graph,
    options: &Options,
    control: &Control,
) -> Result<Option<Report>, GraphError> {
    let file = graph.values().clone();
    let (stop, stumbled) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (stopped, seen, asked) = (Arc::clone(&stop), Arc::clone(&stumbled), control.clone());
    let before = Mutex::new(f64::INFINITY);
    let watch = move |row: &Iteration| {
        let last = before.lock().map_or(f64::INFINITY, |mut x| std::mem::replace(&mut *x, row.cost));
        if row.trials > 1 || row.cost > last || row.iteration >= MANY_ITERATIONS {
            seen.store(true, Ordering::Relaxed);
        }
        stopped.store(seen.load(Ordering::Relaxed) || asked.cancelled(), Ordering::Relaxed);
        if let Some(progress) = &asked.progress {
            progress(row);
        }
    };
    let control = Control { cancel: Some(stop), progress: Some(Arc::new(watch)) };
    if let Ok(report) = Solver::new(options.clone())?.with_control(control).optimise(graph)
        && !stumbled.load(Ordering::Relaxed)
        && report.termination != Termination::Stalled
    {
        return Ok(Some(report));
    }
    *graph.values_mut() = file;
    Ok(None)
}

/// A start that was tried.
struct Tried {
    start: Start,
    /// The cost it led to.
    cost: f64,
    /// Where it began and where it led.
    values: [Values; 2],
}

/// Tries every start for a few iterations and goes back to the best one. When the time is over or the solve is cancelled
/// it stays where the best of those tried so far has led.
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
        // A start that cannot be made or solved from does not count, that is all.
        let made = begin(graph, start, options, control, began).is_ok();
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
