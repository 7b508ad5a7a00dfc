//! Covariance of the odometry as loops show it.

use motorcade_geometry::robust::quantile;
use motorcade_graph::{FactorId, Graph, GraphError, GroupId, LossScale, Options, optimise};

use super::options::LoopOptions;

/// Share of the loops that must agree.
const AGREEING: f64 = 0.9;
/// The quantile of χ² with 6 degrees of freedom at that share.
const CHI_SQUARED: f64 = 10.64;
/// Margin of agreement over chance: an edge in the flank of its kernel loses weight, moves away, and loses all.
const MARGIN: f64 = 4.0;
/// Least growth from solution to solution.
const LEAST_GROWTH: f64 = 2.0;

/// Multiplies the covariances of the group `odometry` by the least factor, at most `most`, at which nine tenths of the loops agree with the solution,
/// and returns it. Odometry also drifts one way, by a bias of heading or scale that its covariance does not hold; loops that were verified
/// one by one and agree with each other would all be taken for outliers of it. Expects the kernels of the loops off, and leaves them so.
pub(super) fn odometry(
    graph: &mut Graph,
    odometry: GroupId,
    loops: &[FactorId],
    options: &LoopOptions,
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
        let expected = CHI_SQUARED / (options.correlation * MARGIN);
        let excess = quantile(&mut squares, AGREEING).unwrap_or(0.0) / expected;
        if excess <= 1.0 || factor >= options.most_odometry_factor {
            return Ok(factor);
        }
        factor = (factor * excess.max(LEAST_GROWTH)).min(options.most_odometry_factor);
        graph.set_scale(odometry, LossScale::variance(factor))?;
    }
}
