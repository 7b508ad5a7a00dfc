//! Graduated non-convexity: a robust solve that starts convex.

use std::time::Instant;

use motorcade_sparse::Stop;

use super::driver::Solver;
use super::options::{Control, Options};
use super::report::Report;
use crate::GraphError;
use crate::graph::Graph;
use crate::group::{GroupId, LossScale};

/// Options of [`graduate`].
#[derive(Clone, Debug, serde::Serialize)]
pub struct GraduateOptions {
    /// Scale of the kernels of the group \[standard deviations\].
    pub c: f64,
    /// μ is divided by this from round to round.
    pub factor: f64,
    /// Linearisations in each round.
    pub iterations_per_round: usize,
    /// Rounds at most.
    pub max_rounds: usize,
}

impl Default for GraduateOptions {
    fn default() -> Self {
        Self { c: 1.0, factor: 1.4, iterations_per_round: 2, max_rounds: 60 }
    }
}

/// Solves a graph whose doubtful factors, under Geman–McClure kernels, are in `group`: first as plain least squares, then with
/// falling μ down to Geman–McClure, then to convergence. Returns the report of the last solve.
///
/// The time limit of `options` is for all rounds together; when it is over, or `control` cancels, what is left is one
/// iteration at μ = 1.
///
/// μ starts where the worst residual of the *solved* least-squares graph is still in the convex part; unsolved
/// values, which may satisfy doubtful factors exactly, give no scale.
pub fn graduate(
    graph: &mut Graph,
    group: GroupId,
    options: &Options,
    schedule: &GraduateOptions,
    control: &Control,
) -> Result<Report, GraphError> {
    graduate_unless(graph, group, options, schedule, control, Stop::NEVER)
}

/// As [`graduate`], also ended when `stop` says so: what is left is then not even one iteration.
pub fn graduate_unless(
    graph: &mut Graph,
    group: GroupId,
    options: &Options,
    schedule: &GraduateOptions,
    control: &Control,
    stop: Stop<'_>,
) -> Result<Report, GraphError> {
    if schedule.factor.is_nan() || schedule.factor <= 1.0 {
        let reason = format!("{} must be above 1", schedule.factor);
        return Err(GraphError::Option { name: "factor", reason });
    }
    graph.set_scale(group, LossScale::convexity(f64::INFINITY))?;
    let start = Instant::now();
    let quiet = Control { progress: None, ..control.clone() };
    let mut solver = Solver::new(options.clone())?.with_control(quiet);
    solver.optimise_unless(graph, stop)?;
    let mut worst = 0.0_f64;
    for (_, factor) in graph.factors() {
        worst = worst.max(factor.squared_norm(graph.values())?);
    }
    let mut mu = (2.0 * worst / (schedule.c * schedule.c)).max(1.0);
    let short = Options { max_iterations: schedule.iterations_per_round, ..options.clone() };
    short.validate()?;
    // One solver: a second one would hold matrix and factor of the same pattern again.
    solver.set_max_iterations(short.max_iterations);
    for _ in 0..schedule.max_rounds {
        if control.cancelled() || stop.asked() || options.out_of_time(start) {
            break;
        }
        graph.set_scale(group, LossScale::convexity(mu))?;
        solver.set_time_limit_s(options.remaining(start).time_limit_s);
        solver.optimise_unless(graph, stop)?;
        if mu <= 1.0 {
            break;
        }
        mu = (mu / schedule.factor).max(1.0);
    }
    graph.set_scale(group, LossScale::convexity(1.0))?;
    solver.set_max_iterations(options.max_iterations);
    solver.set_time_limit_s(options.remaining(start).time_limit_s);
    solver.with_control(control.clone()).optimise_unless(graph, stop)
}
