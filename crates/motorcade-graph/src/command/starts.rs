//! Where `graph optimise` starts.

use std::str::FromStr;

use serde::Serialize;

use crate::GraphError;
use crate::graph::Graph;
use crate::solver::{Control, Options, Solver};
use crate::start;
use crate::values::Values;

/// Where the optimisation starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At the one of the three below from which a few iterations lead to the least cost.
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

/// Iterations after which starts are compared.
const TRIAL: usize = 5;

/// How much lower, as a fraction, the cost from another start must be to leave the file's.
const BETTER: f64 = 1e-3;

/// Moves `graph` to the start asked for and returns which it is.
pub(super) fn begin(
    graph: &mut Graph,
    wanted: Start,
    options: &Options,
    control: &Control,
) -> Result<Start, GraphError> {
    match wanted {
        Start::Auto => return choose(graph, options, control),
        Start::File => {}
        Start::SpanningTree => start::spanning_tree(graph)?,
        Start::Chordal => start::chordal(graph)?,
    }
    Ok(wanted)
}

/// Tries every start for a few iterations and goes back to the best one.
fn choose(graph: &mut Graph, options: &Options, control: &Control) -> Result<Start, GraphError> {
    let file = graph.values().clone();
    let options = Options { max_iterations: TRIAL.min(options.max_iterations), ..options.clone() };
    let mut solver = Solver::new(options)?.with_control(Control { progress: None, ..control.clone() });
    let mut best: (f64, Start, Values) = (f64::INFINITY, Start::File, file.clone());
    for start in [Start::File, Start::Chordal, Start::SpanningTree] {
        *graph.values_mut() = file.clone();
        // A start that cannot be made or solved from does not count, that is all.
        let made = begin(graph, start, solver.options(), control).is_ok();
        if !made || (start != Start::File && *graph.values() == file) {
            continue;
        }
        let values = graph.values().clone();
        let cost = solver.optimise(graph).map_or(f64::INFINITY, |report| report.final_cost);
        if cost < (1.0 - BETTER) * best.0 {
            best = (cost, start, values);
        }
    }
    let (_, start, values) = best;
    *graph.values_mut() = values;
    Ok(start)
}
