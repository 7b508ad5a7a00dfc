//! Covariance of the odometry as loops show it.
//!
//! Odometry also drifts one way, by a bias of heading or scale that its covariance does not hold; loops that were verified one by one and agree with
//! each other would all be taken for outliers of it.

use motorcade_geometry::robust::quantile;
use motorcade_graph::{FactorId, Graph, GraphError, GroupId, LossScale, Marginals};

use super::options::AdvancedLoopOptions;
use super::solve::LoopSolve;

/// Degrees of freedom of a step.
const DOF: f64 = 6.0;

/// Multiplies the covariances of the group `odometry` by the least factor, at most `most_odometry_factor`, at which `agreeing_share` of the loops
/// agree with the solution as chance has it, and returns it. Expects the kernels of the loops off, and leaves them so.
pub(super) fn until_most_agree(
    graph: &mut Graph,
    odometry: GroupId,
    loops: &[FactorId],
    options: &AdvancedLoopOptions,
    solve: &LoopSolve<'_>,
) -> Result<f64, GraphError> {
    let mut factor = 1.0;
    loop {
        solve.optimise(graph)?;
        let square = |id: &FactorId| {
            let found = graph.factor(*id).ok_or(GraphError::UnknownFactor(*id))?;
            found.squared_norm(graph.values())
        };
        let mut squares: Vec<f64> = loops.iter().map(square).collect::<Result<_, _>>()?;
        // The covariances of loops are larger than the errors of each by that factor.
        let expected = options.agreeing_chi2 / options.correlation;
        let excess = quantile(&mut squares, options.agreeing_share).unwrap_or(0.0) / expected;
        if excess <= 1.0 || factor >= options.most_odometry_factor {
            return Ok(factor);
        }
        factor = (factor * excess.max(options.least_growth)).min(options.most_odometry_factor);
        graph.set_scale(odometry, LossScale::variance(factor))?;
    }
}

/// Multiplies the covariances of the group `odometry`, which has `steps` factors, by the factor, from `first` to `most_odometry_factor`, at which steps and
/// loops together are most probable: where most agree by chance, the ends of a drive may still be off one way. Where loops are off by no more than
/// their own deviations, a less certain odometry makes nothing more probable. Expects the kernels of the loops on, and a solution.
pub(super) fn to_most_probable(
    graph: &mut Graph,
    (odometry, steps): (GroupId, usize),
    first: f64,
    options: &AdvancedLoopOptions,
    solve: &LoopSolve<'_>,
) -> Result<f64, GraphError> {
    let (mut best, mut least, mut factor) = (first, f64::INFINITY, first);
    while factor <= options.most_odometry_factor && factor <= best * options.beyond_best {
        graph.set_scale(odometry, LossScale::variance(factor))?;
        solve.optimise(graph)?;
        // −2 ln of the probability of all measurements, whatever the poses, but for a constant (Laplace).
        let of_covariances =
            DOF * steps as f64 * f64::ln(factor) + Marginals::log_determinant(graph, solve.stop)?;
        let improbable = graph.cost()? + of_covariances;
        if improbable < least {
            (best, least) = (factor, improbable);
        }
        factor *= options.least_growth;
    }
    graph.set_scale(odometry, LossScale::variance(best))?;
    solve.optimise(graph)?;
    Ok(best)
}
