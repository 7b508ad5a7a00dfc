//! Report of a solve.

use serde::Serialize;

/// Why a solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Termination {
    /// The cost no longer falls.
    Converged,
    /// Steps became too small to matter.
    SmallStep,
    /// The iteration limit.
    Iterations,
    /// The time limit.
    Time,
    /// Cancelled from outside.
    Cancelled,
    /// No damping gave a better point although the gradient promised one.
    Stalled,
    /// Every variable is fixed, or there is none.
    NothingToDo,
}

/// One linearisation and its step.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Iteration {
    /// From 1.
    pub iteration: usize,
    /// Cost after the iteration.
    pub cost: f64,
    /// Damping of the last step tried (0: Gauss–Newton); for the dog-leg the trust radius.
    pub lambda: f64,
    /// Actual over predicted decrease of the last step tried.
    pub gain: f64,
    /// Largest component of the last step tried \[rad, m\].
    pub step: f64,
    /// Steps tried.
    pub trials: usize,
    /// False where the factor of an earlier iteration was good enough for the step.
    pub factorised: bool,
    /// Seconds since the start (wall clock).
    pub elapsed_s: f64,
}

/// Wall-clock seconds by kind of work.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Timings {
    /// Pattern, ordering, symbolic factorisation.
    pub analyse_s: f64,
    /// Residuals, Jacobians, normal equations.
    pub linearise_s: f64,
    /// Numeric factorisation, with the forward substitution done on the way.
    pub factorise_s: f64,
    /// Other triangular solves.
    pub solve_s: f64,
    /// Retraction and cost at trial points.
    pub evaluate_s: f64,
    /// All.
    pub total_s: f64,
}

/// Result of a solve.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Why it stopped.
    pub termination: Termination,
    /// Cost `Σ ρ(rᵀ Ω r)` at the start.
    pub initial_cost: f64,
    /// The same at the end.
    pub final_cost: f64,
    /// One row for each linearisation.
    pub iterations: Vec<Iteration>,
    /// Scalar unknowns.
    pub unknowns: usize,
    /// Scalars in the factor.
    pub factor_scalars: usize,
    /// Multiplications of one factorisation.
    pub factor_multiplications: f64,
    /// Lower bound of the condition number of the last matrix factorised: squared ratio of its extreme pivots.
    pub condition: f64,
    /// Time by kind of work.
    pub timings: Timings,
}

impl Report {
    /// True when a minimum was reached, as opposed to a limit.
    pub fn converged(&self) -> bool {
        matches!(self.termination, Termination::Converged | Termination::SmallStep | Termination::NothingToDo)
    }
}
