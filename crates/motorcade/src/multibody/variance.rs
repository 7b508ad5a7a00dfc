//! Variance components: by how much the covariances of a class of camera–vehicle edges are too small, told by its residuals.
//!
//! Residuals to a steady way show what of the errors changes from frame to frame, not what lasts for seconds, which the covariances
//! hold too ([`GraphOptions::correlated_frames`]). A class is therefore found worse than it says, but never better: with factors
//! below 1 the poses of a rendered drive claimed half their true error. Odometry and the motion model are not judged:
//! residuals of the one are nearly none, and the other is what residuals are measured against.

use motorcade_graph::{Factor, FactorId, Graph, GraphError, Marginals};
use nalgebra::{DMatrix, DMatrixViewMut, DVector, DVectorViewMut};
use serde::Serialize;

use super::classes::{ClassScales, EdgeClass, kernel_of};
use super::{GraphKernel, GraphOptions};

/// What was found of a class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VarianceFactor {
    /// The class.
    pub class: EdgeClass,
    /// Edges.
    pub edges: usize,
    /// Residuals less what the estimate has taken of them.
    pub degrees_of_freedom: f64,
    /// What residuals alone say the class' variances are to be multiplied by; 1 where there is too little to tell.
    pub found: f64,
    /// What they are multiplied by: `found`, from 1 to 16.
    pub factor: f64,
}

/// Residuals that tell a factor to a quarter of itself (√(2/30)).
const LEAST_DEGREES: f64 = 30.0;
/// Factors beyond are taken for a wrong model rather than wrong noise.
const MOST: f64 = 16.0;

/// One edge of a class.
struct WhitenedResidual {
    /// Squared whitened residual before the factor.
    s: f64,
    dim: f64,
    /// Share of the residual's freedom that the estimate has taken: w tr(J P Jᵀ Ω), P the covariance of the edge's variables.
    leverage: f64,
}

/// Re-estimates the factors of all classes from the residuals at the minimum and puts them into `scales`.
///
/// For weights w and freedoms d of the residuals `f = Σ w rᵀΩr / Σ w (d − leverage)` (Helmert, Förstner), solved for f with
/// w at `rᵀΩr / f`, and divided by what the kernel makes of it for Gaussian noise.
pub(crate) fn estimate(
    graph: &Graph,
    edges: &[(FactorId, EdgeClass)],
    scales: &ClassScales,
    options: &GraphOptions,
) -> Result<Vec<VarianceFactor>, GraphError> {
    let marginals = Marginals::new(graph)?;
    let mut told: [Vec<WhitenedResidual>; 6] = Default::default();
    for (id, class) in edges.iter().filter(|(_, class)| class.is_sighting()) {
        let Some(factor) = graph.factor(*id) else { continue };
        told[*class as usize].extend(tell(graph, &marginals, factor)?);
    }
    let mut out = Vec::new();
    for (class, all) in EdgeClass::ALL.into_iter().zip(&told).filter(|(_, all)| !all.is_empty()) {
        let degrees_of_freedom = all.iter().map(|t| t.dim - t.leverage).sum();
        let kernel = kernel_of(class, options);
        let found = if degrees_of_freedom < LEAST_DEGREES {
            1.0
        } else {
            solve(all, scales.get(class), kernel, options.kernel_scale)
        };
        let factor = found.clamp(1.0, MOST);
        scales.set(class, factor);
        out.push(VarianceFactor { class, edges: all.len(), degrees_of_freedom, found, factor });
    }
    Ok(out)
}

/// What an edge tells; `None` when all its variables are held.
fn tell(
    graph: &Graph,
    marginals: &Marginals,
    factor: &dyn Factor,
) -> Result<Option<WhitenedResidual>, GraphError> {
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
    let weight = factor.loss(factor.squared_norm(graph.values())?).weight;
    let told = &ROWS_THAT_TELL;
    let (r, j) = (r.select_rows(told), j.select_rows(told));
    let information = factor.information().select_rows(told).select_columns(told);
    let leverage = weight * (&j * covariance * j.transpose() * &information).trace();
    let s = (r.transpose() * information * r)[0];
    Ok(Some(WhitenedResidual { s, dim: told.len() as f64, leverage: leverage.clamp(0.0, told.len() as f64) }))
}

/// Rows of a residual that are measured rather than assumed, along and across: upright is assumed of all vehicles, the heading of
/// boxes, and height over the road follows the plane.
const ROWS_THAT_TELL: [usize; 2] = [3, 4];

/// The factor at which weighted squares and freedoms agree.
fn solve(all: &[WhitenedResidual], start: f64, kernel: GraphKernel, c: f64) -> f64 {
    const ROUNDS: usize = 50;
    let dim = all.first().map_or(1.0, |t| t.dim);
    let expected = expected_ratio(kernel, c, dim);
    let mut factor = start;
    for _ in 0..ROUNDS {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for t in all {
            let w = kernel.loss(c, t.s / factor).weight;
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
fn expected_ratio(kernel: GraphKernel, c: f64, dim: f64) -> f64 {
    const STEP: f64 = 0.01;
    const STEPS: usize = 8000;
    let (mut squares, mut freedom) = (0.0, 0.0);
    for k in 0..STEPS {
        let s = STEP * (k as f64 + 0.5);
        let density = (0.5 * dim - 1.0) * s.ln() - 0.5 * s;
        let w = kernel.loss(c, s).weight * density.exp();
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
            assert!((expected_ratio(GraphKernel::None, 1.0, dim) - 1.0).abs() < 1e-3);
            assert!((expected_ratio(GraphKernel::Cauchy, 100.0, dim) - 1.0).abs() < 1e-2);
            assert!(expected_ratio(GraphKernel::Cauchy, 1.0, dim) < 0.9);
        }
    }
}
