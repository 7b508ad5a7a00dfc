//! Arguments of `motorcade graph`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use motorcade_graph::factors::PoseResidual;
use motorcade_graph::solver::Method;
use motorcade_graph::start::Start;

use super::KernelChoice;

/// `motorcade graph`.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  motorcade graph optimise sphere.g2o --out solved.g2o
  motorcade graph info sphere.g2o
  motorcade graph compare solved.g2o other.g2o")]
pub enum GraphCommand {
    /// Optimises a g2o pose graph.
    #[command(visible_alias = "optimize")]
    Optimise(OptimiseArguments),
    /// Describes a g2o file: vertices, edges, components, cost.
    Info(InfoArguments),
    /// Differences between the vertices of two g2o files, and the cost of both under the edges of the first.
    Compare(CompareArguments),
}

/// `motorcade graph optimise`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  motorcade graph optimise sphere.g2o --out solved.g2o --init chordal
  motorcade graph optimise city.g2o --out solved.g2o --method dogleg --robust cauchy:1.0 --json report.json
  motorcade graph optimise large.g2o --out solved.g2o --time-limit-s 60

Ctrl-C stops after the current iteration, or within a long factorisation, and writes the best graph so far (exit code 130).")]
pub struct OptimiseArguments {
    /// The graph.
    pub input: PathBuf,
    /// File for the optimised graph.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Step: lm, gn or dogleg.
    #[arg(long, default_value = "lm")]
    pub method: Method,
    /// Residual of 3D edges: log (of the relative pose) or mqt (g2o's translation and quaternion).
    #[arg(long, default_value = "log")]
    pub cost: PoseResidual,
    /// Robust kernel of all edges and its scale: huber, cauchy, geman-mcclure, dcs or gnc, such as cauchy:1.0.
    #[arg(long, value_name = "KERNEL:SCALE")]
    pub robust: Option<KernelChoice>,
    /// Starting values: file, spanning-tree, chordal, or auto: the file, unless a step from there is refused; then a few steps
    /// from each are tried and the best start is taken.
    #[arg(long, default_value = "auto")]
    pub init: Start,
    /// Most iterations.
    #[arg(long, default_value_t = 100)]
    pub iterations: usize,
    /// Most seconds for all of it, the choice of a start included; the best graph so far is written. Looked at between
    /// iterations and within long factorisations.
    #[arg(long, value_name = "SECONDS", value_parser = super::parse_seconds)]
    pub time_limit_s: Option<f64>,
    /// Threads; the results do not depend on it. 0 takes all cores.
    #[arg(long, default_value_t = 1, value_parser = super::parse_threads)]
    pub threads: usize,
    /// Also write what was done, iteration by iteration, as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// `motorcade graph info`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  motorcade graph info sphere.g2o --json")]
pub struct InfoArguments {
    /// The graph.
    pub input: PathBuf,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `motorcade graph compare`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  motorcade graph compare mine.g2o gtsam.g2o")]
pub struct CompareArguments {
    /// First graph; its edges define the costs.
    pub first: PathBuf,
    /// Second graph.
    pub second: PathBuf,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}
