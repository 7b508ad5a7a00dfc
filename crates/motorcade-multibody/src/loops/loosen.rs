//! Covariance of the odometry as loops show it.
//!
//! Odometry also drifts one way, by a bias of heading or scale that its covariance does not hold; loops that were verified one by one and agree with
//! each other would all be taken for outliers of it.

use motorcade_geometry::robust::quantile;
use motorcade_graph::{FactorId, Graph, GraphError, GroupId, LossScale, Marginals, Options, optimise};

use super::options::AdvancedLoopOptions;

/// Degrees of freedom of a step.
const DOF: f64 = 6.0;

/// Multiplies the covariances of the group `odometry` by the least factor, at most `most_odometry_factor`, at which `agreeing_share` of the loops
/// agree with the solution, and better than by chance, and returns it. Expects the kernels of the loops off, and leaves them so.
pub(super) fn until_most_agree(
    graph: &mut Graph,
    odometry: GroupId,
    loops: &[FactorId],
    options: &AdvancedLoopOptions,
    solver: &Options,
) -> Result<f64, GraphError> {
    let mut factor = 1.0;
    loop {
        optimise(graph, solver)?;
        let square = |id: &FactorId| {
            let found = graph.factor(*id).ok_or(GraphError::UnknownFactor(*id))?;
            found.squared_norm(graph.values())
        };
        let mut squares: Vec<f64> = loops.iter().map(square).collect::<Result<_, _>>()?;
        // The covariances of loops are larger than the errors of each by that factor.
        let expected = options.agreeing_chi2 / (options.correlation * options.agreeing_margin);
        let excess = quantile(&mut squares, options.agreeing_share).unwrap_or(0.0) / expected;
        if excess <= 1.0 || factor >= options.most_odometry_factor {
            return Ok(factor);
        }
        factor = (factor * excess.max(options.least_growth)).min(options.most_odometry_factor);
        graph.set_scale(odometry, LossScale::variance(factor))?;
    }
}

/// Divides the factor `most` of the covariances of the group `odometry`, which has `steps` factors, by the number, at which steps and loops together are most
/// probable, and returns what is left, at least 1. Loops that are off by their own deviations never agree better than by chance: the factor at which they seem to is that of an odometry
/// that hardly counts. Expects the kernels of the loops on, and a solution, which is followed as long as it keeps the loops that hold.
pub(super) fn to_most_probable(
    graph: &mut Graph,
    (odometry, steps): (GroupId, usize),
    loops: &[FactorId],
    most: f64,
    options: &AdvancedLoopOptions,
    solver: &Options,
) -> Result<f64, GraphError> {
    let (mut best, mut least, mut factor) = ((most, graph.values().clone()), f64::INFINITY, most);
    let at_first = holding(graph, loops, options)?;
    loop {
        graph.set_scale(odometry, LossScale::variance(factor))?;
        optimise(graph, solver)?;
        if holding(graph, loops, options)? < at_first {
            break;
        }
        // −2 ln of the probability of all measurements, whatever the poses, but for a constant (Laplace).
        let of_covariances = DOF * steps as f64 * f64::ln(factor) + Marginals::log_determinant(graph)?;
        let improbable = graph.cost()? + of_covariances;
        if improbable < least {
            (best, least) = ((factor, graph.values().clone()), improbable);
        }
        if factor <= 1.0 || factor * options.below_best < best.0 {
            break;
        }
        factor = (factor / options.most_shrinkage).max(1.0);
    }
    let (factor, values) = best;
    graph.set_scale(odometry, LossScale::variance(factor))?;
    *graph.values_mut() = values;
    Ok(factor)
}

/// Number of loops that are not switched off.
fn holding(graph: &Graph, loops: &[FactorId], options: &AdvancedLoopOptions) -> Result<usize, GraphError> {
    let weights: Vec<f64> =
        loops.iter().map(|id| graph.loss(*id).map(|l| l.weight)).collect::<Result<_, _>>()?;
    Ok(weights.into_iter().filter(|weight| *weight >= options.least_weight).count())
}
