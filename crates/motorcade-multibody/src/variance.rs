//! Variance components: factors on the covariances of classes of camera–vehicle edges, from their residuals (Helmert, Förstner).
//!
//! Residuals show errors that change from frame to frame, not those that last for seconds, which the covariances hold too.
//! Factors are therefore at least 1. Odometry and the motion model keep their covariances: residuals are measured against them.

use motorcade_graph::{FactorId, Graph, GraphError, LossScale, Marginals, RobustKernel, Stop};
use nalgebra::{DMatrix, DMatrixViewMut, DVector, DVectorViewMut};
use serde::Serialize;

use crate::classes::{ClassGroups, EdgeClass};
use crate::options::GraphOptions;

/// The variance factor of a class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VarianceFactor {
    /// The class.
    pub class: EdgeClass,
    /// Number of edges.
    pub edges: usize,
    /// Dimension of the residuals less their leverages.
    pub degrees_of_freedom: f64,
    /// Factor from the residuals alone; 1 where there are too few.
    pub found: f64,
    /// Factor on the variances: `found`, limited to 1 and above.
    pub factor: f64,
}

/// One edge of a class.
struct WhitenedResidual {
    /// Squared whitened residual before the factor.
    s: f64,
    dim: f64,
    /// Leverage w tr(J P Jᵀ Ω), P the covariance of the edge's variables: the part of the residual fitted by the estimate.
    leverage: f64,
}

/// Re-estimates the factors of all classes from the residuals at the minimum and sets them as scales of the groups.
///
/// For weights w and dimensions d of the residuals `f = Σ w rᵀΩr / Σ w (d − leverage)` (Helmert, Förstner), solved for f with
/// w at `rᵀΩr / f`, and divided by what the kernel makes of it for Gaussian noise.
pub(crate) fn estimate(
    graph: &mut Graph,
    edges: &[(FactorId, EdgeClass)],
    groups: &ClassGroups,
    mean_interval_s: f64,
    options: &GraphOptions,
    stop: Stop<'_>,
) -> Result<Vec<VarianceFactor>, GraphError> {
    let measured = edges.iter().filter(|(_, class)| EdgeClass::MEASUREMENTS.contains(class));
    let sets = measured.filter_map(|(id, _)| graph.factor(*id)).map(|factor| factor.variables().to_vec());
    let marginals = Marginals::of_sets(graph, sets, stop)?;
    let mut residuals: [Vec<WhitenedResidual>; 3] = Default::default();
    for (id, class) in edges {
        let Some(at) = EdgeClass::MEASUREMENTS.iter().position(|c| c == class) else { continue };
        residuals[at].extend(whitened_residual(graph, &marginals, *id)?);
    }
    let mut out = Vec::new();
    for (class, all) in EdgeClass::MEASUREMENTS.into_iter().zip(&residuals).filter(|(_, all)| !all.is_empty())
    {
        let Some(group) = groups.of(class) else { continue };
        let degrees_of_freedom = all.iter().map(|t| t.dim - t.leverage).sum();
        let found = if degrees_of_freedom < options.advanced.least_degrees_of_freedom {
            1.0
        } else {
            solve(all, graph.scale(group).variance, class.kernel(mean_interval_s, options))
        };
        let factor = found.min(options.advanced.most_variance_factor).max(1.0);
        graph.set_scale(group, LossScale::variance(factor))?;
        out.push(VarianceFactor { class, edges: all.len(), degrees_of_freedom, found, factor });
    }
    Ok(out)
}

/// Residual and leverage of an edge; `None` when all its variables are fixed.
fn whitened_residual(
    graph: &Graph,
    marginals: &Marginals,
    id: FactorId,
) -> Result<Option<WhitenedResidual>, GraphError> {
    let factor = graph.factor(id).ok_or(GraphError::UnknownFactor(id))?;
    let variables = factor.variables();
    if variables.iter().all(|v| graph.is_fixed(*v)) {
        return Ok(None);
    }
    let covariance = marginals.joint(variables)?;
    let m = factor.dim();
    let (mut r, mut j) = (DVector::zeros(m), DMatrix::zeros(m, covariance.nrows()));
    factor.evaluate(
        graph.values(),
        &mut DVectorViewMut::from_slice(r.as_mut_slice(), m),
        Some(&mut DMatrixViewMut::from_slice(j.as_mut_slice(), m, covariance.nrows())),
    )?;
    let weight = graph.loss(id)?.weight;
    let rows = &MEASURED_ROWS;
    let (r, j) = (r.select_rows(rows), j.select_rows(rows));
    let information = factor.information().select_rows(rows).select_columns(rows);
    let leverage = weight * (&j * covariance * j.transpose() * &information).trace();
    let s = (r.transpose() * information * r)[0];
    Ok(Some(WhitenedResidual { s, dim: rows.len() as f64, leverage: leverage.clamp(0.0, rows.len() as f64) }))
}

/// Rows of a residual that are measured, position along and across: all vehicles are assumed upright, boxes have an assumed
/// heading, and the height follows from the road plane.
const MEASURED_ROWS: [usize; 2] = [3, 4];

/// The factor at which weighted squares and degrees of freedom agree.
fn solve(all: &[WhitenedResidual], start: f64, kernel: RobustKernel) -> f64 {
    const ROUNDS: usize = 50;
    let dim = all.first().map_or(1.0, |t| t.dim);
    let expected = expected_ratio(kernel, dim);
    let mut factor = start;
    for _ in 0..ROUNDS {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for t in all {
            let w = kernel.weight(t.s / factor);
            squares += w * t.s;
            freedom += w * (t.dim - t.leverage);
        }
        let next = squares / (expected * freedom).max(1e-12);
        let settled = (next / factor - 1.0).abs() < 1e-6;
        factor = next.max(1e-6);
        if settled {
            break;
        }
    }
    factor
}

/// `E[w s] / (d E[w])` for s = χ²_d: 1 without a kernel, less with one.
fn expected_ratio(kernel: RobustKernel, dim: f64) -> f64 {
    const STEP: f64 = 0.01;
    const STEPS: usize = 8000;
    let (mut squares, mut freedom) = (0.0, 0.0);
    for k in 0..STEPS {
        let s = STEP * (k as f64 + 0.5);
        let density = (0.5 * dim - 1.0) * s.ln() - 0.5 * s;
        let w = kernel.weight(s) * density.exp();
        squares += w * s;
        freedom += w * dim;
    }
    squares / freedom
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_that_cut_nothing_leave_the_ratio_at_one() {
        for dim in [3.0, 4.0, 6.0] {
            assert!((expected_ratio(RobustKernel::None, dim) - 1.0).abs() < 1e-3);
            assert!((expected_ratio(RobustKernel::Cauchy(100.0), dim) - 1.0).abs() < 1e-2);
            assert!(expected_ratio(RobustKernel::Cauchy(1.0), dim) < 0.9);
        }
    }
}
