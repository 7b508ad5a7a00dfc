//! Covariance of the odometry as loops show it.

use motorcade_geometry::robust::quantile;
use motorcade_graph::{FactorId, Graph, GraphError, GroupId, LossScale, Options, optimise};

use super::options::LoopOptions;

/// Multiplies the covariances of the group `odometry` by the least factor, at most `most_odometry_factor`, at which `agreeing_share` of the loops
/// agree with the solution, and returns it. Odometry also drifts one way, by a bias of heading or scale that its covariance does not hold;
/// loops that were verified one by one and agree with each other would all be taken for outliers of it. Expects the kernels of the loops off, and leaves them so.
pub(super) fn odometry(
    graph: &mut Graph,
    odometry: GroupId,
    loops: &[FactorId],
    options: &LoopOptions,
    solver: &Options,
) -> Result<f64, GraphError> {
    let advanced = &options.advanced;
    let mut factor = 1.0;
    loop {
        optimise(graph, solver)?;
        let square = |id: &FactorId| {
            let found = graph.factor(*id).ok_or(GraphError::UnknownFactor(*id))?;
            found.squared_norm(graph.values())
        };
        let mut squares: Vec<f64> = loops.iter().map(square).collect::<Result<_, _>>()?;
        // The covariances of loops are larger than the errors of each by that factor.
        let expected = advanced.agreeing_chi2 / advanced.correlation;
        let excess = quantile(&mut squares, advanced.agreeing_share).unwrap_or(0.0) / expected;
        if excess <= 1.0 || factor >= advanced.most_odometry_factor {
            return Ok(factor);
        }
        factor = (factor * excess.max(advanced.least_growth)).min(advanced.most_odometry_factor);
        graph.set_scale(odometry, LossScale::variance(factor))?;
    }
}
