//! Levenberg–Marquardt on one vehicle: dense, on the stack.

use nalgebra::{SMatrix, SVector};

use super::model::State;
use super::options::AdvancedFitOptions;
use super::problem::{Problem, Row, Term};
use super::{DOF, MAX_SHAPE};

/// Normal equations at a state: H = Σ ρ' JᵀJ (14×14), g = Σ ρ' Jᵀr.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub h: SMatrix<f64, DOF, DOF>,
    pub g: SVector<f64, DOF>,
    pub cost: f64,
}

impl Normal {
    /// Sums the rows selected by `keep`.
    pub fn of(problem: &Problem<'_>, rows: &[Row], keep: impl Fn(Term) -> bool) -> Self {
        let mut out = Self { h: SMatrix::zeros(), g: SVector::zeros(), cost: 0.0 };
        for (group, cost, weight) in robust_groups(problem, rows).filter(|(group, ..)| keep(group[0].term)) {
            out.cost += cost;
            for row in group {
                let weighted = row.j * weight;
                // Explicit loops: for matrices this small, calls cost more than the arithmetic.
                for c in 0..DOF {
                    for r in 0..DOF {
                        out.h[(r, c)] += weighted[r] * row.j[c];
                    }
                }
                out.g.axpy(row.r, &weighted, 1.0);
            }
        }
        out.h.fill_upper_triangle_with_lower_triangle();
        out
    }
}

/// The robust cost of all rows.
pub(crate) fn cost_of(problem: &Problem<'_>, rows: &[Row]) -> f64 {
    robust_groups(problem, rows).map(|(_, cost, _)| cost).sum()
}

/// Rows that share one kernel (both rows of a keypoint), never empty, with its cost and weight.
fn robust_groups<'a>(
    problem: &'a Problem<'_>,
    rows: &'a [Row],
) -> impl Iterator<Item = (&'a [Row], f64, f64)> {
    let keypoint = |row: &Row| matches!(row.term, Term::Keypoint(_));
    rows.chunk_by(move |a, b| keypoint(a) && a.term == b.term).map(|group| {
        let s: f64 = group.iter().map(|r| r.r * r.r).sum();
        let (cost, weight) = problem.robust(group[0].term, s);
        (group, cost, weight)
    })
}

/// Free part of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Free {
    /// Pose and shape.
    All,
    /// Pose alone (equation 7 of the paper).
    Pose,
    /// Shape alone (equation 8).
    Shape,
}

/// Limits of a refinement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    pub max_iterations: usize,
    /// Relative decrease of the cost below which the iteration ends.
    pub tolerance: f64,
}

impl Effort {
    /// Sufficient to compare hypotheses.
    pub const ROUGH: Self = Self { max_iterations: 5, tolerance: 1e-2 };
    /// To the minimum: along the flat valley of depth and size small decreases still move far.
    pub fn full(max_iterations: usize) -> Self {
        Self { max_iterations, tolerance: 1e-6 }
    }
}

/// Result of a refinement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refined {
    pub state: State,
    pub cost: f64,
    pub iterations: usize,
}

/// Applies a step to the pose (on the right) and the shape, shortened to the neighbourhood in which the linear model is valid.
pub(crate) fn step(state: &State, delta: &SVector<f64, DOF>, limits: &AdvancedFitOptions) -> State {
    let pose = &state.camera_from_vehicle;
    let turn = delta.fixed_rows::<3>(0).norm() / limits.step_rad;
    let longest_m = (limits.step_share * pose.translation().norm()).max(limits.step_m);
    let way = delta.fixed_rows::<3>(3).norm() / longest_m;
    let deformation = delta.fixed_rows::<MAX_SHAPE>(6).norm() / limits.step_sigmas;
    let delta = delta / turn.max(way).max(deformation).max(1.0);
    State {
        camera_from_vehicle: pose.retract(&delta.fixed_rows::<6>(0).into_owned()),
        shape: state.shape + delta.fixed_rows::<MAX_SHAPE>(6),
    }
}

/// Levenberg–Marquardt from a state. `None` when it is not in front of the camera.
pub(crate) fn refine(
    problem: &Problem<'_>,
    state: State,
    free: Free,
    effort: Effort,
    rows: &mut Vec<Row>,
) -> Option<Refined> {
    let normal_at = |state: &State, rows: &mut Vec<Row>| {
        problem.rows(state, rows).then(|| hold(Normal::of(problem, rows, |_| true), free))
    };
    let mut state = state;
    let mut normal = normal_at(&state, rows)?;
    let mut damping = 1e-3;
    let mut iterations = 0;
    while iterations < effort.max_iterations && damping < 1e8 {
        iterations += 1;
        let mut damped = normal.h;
        for k in 0..DOF {
            damped[(k, k)] += damping * damped[(k, k)] + 1e-9;
        }
        let Some(factor) = damped.cholesky() else {
            damping *= 10.0;
            continue;
        };
        let delta = factor.solve(&-normal.g);
        let trial = step(&state, &delta, &problem.options.advanced);
        match normal_at(&trial, rows) {
            Some(there) if there.cost < normal.cost => {
                let gain = normal.cost - there.cost;
                let settled = gain < effort.tolerance * (1.0 + there.cost) || delta.norm() < 1e-6;
                state = trial;
                normal = there;
                damping = (damping * 0.1).max(1e-9);
                if settled {
                    break;
                }
            }
            _ => {
                if delta.norm() < 1e-6 {
                    break;
                }
                damping *= 10.0;
            }
        }
    }
    Some(Refined { state, cost: normal.cost, iterations })
}

/// Removes held and unused coefficients from the equations.
fn hold(mut normal: Normal, free: Free) -> Normal {
    let range = match free {
        Free::All => 0..0,
        Free::Pose => 6..DOF,
        Free::Shape => 0..6,
    };
    for k in range {
        normal.h.row_mut(k).fill(0.0);
        normal.h.column_mut(k).fill(0.0);
        normal.g[k] = 0.0;
    }
    for k in 0..DOF {
        if normal.h[(k, k)] == 0.0 {
            normal.h[(k, k)] = 1.0;
        }
    }
    normal
}
