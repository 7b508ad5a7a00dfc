//! Checks of a factor's derivatives against numeric ones, for tests of built-in and custom factors alike.

use motorcade_geometry::numeric;
use nalgebra::{DMatrix, DMatrixViewMut, DVector, DVectorViewMut};

use crate::GraphError;
use crate::factor::{Factor, Normal};
use crate::manifold::Manifold;
use crate::values::Values;

/// Largest difference between the factor's Jacobian and central differences along its variables' tangents, relative
/// to the larger of 1 and the largest entry.
pub fn jacobian_error(factor: &dyn Factor, values: &Values) -> Result<f64, GraphError> {
    let (_, analytic) = evaluate(factor, values)?;
    numeric::jacobian_error(&analytic, |step| {
        let (mut moved, mut start) = (values.clone(), 0);
        for &id in factor.variables() {
            let value = values.value(id)?;
            moved.put(id, value.retract(&step.as_slice()[start..start + value.dof()]));
            start += value.dof();
        }
        Ok(evaluate(factor, &moved)?.0)
    })
}

/// Largest difference between [`Factor::normal_equations`] and `JᵀΩJ`, `JᵀΩr`, `rᵀΩr` out of
/// [`Factor::evaluate`], relative to the larger of 1 and the largest entry of H.
pub fn normal_equations_error(factor: &dyn Factor, values: &Values) -> Result<f64, GraphError> {
    let (r, j) = evaluate(factor, values)?;
    let n = j.ncols();
    let information = factor.information().clone_owned();
    let (h, g, s) =
        (j.transpose() * &information * &j, j.transpose() * &information * &r, r.dot(&(&information * &r)));
    let mut normal = Normal::default();
    normal.resize(n);
    let mut worst = (factor.normal_equations(values, &mut normal)? - s).abs();
    worst = worst.max((factor.squared_norm(values)? - s).abs());
    let mut start = 0;
    for &id in factor.variables() {
        let dof = values.value(id)?.dof();
        for column in start..start + dof {
            worst = worst.max((normal.g()[column] - g[column]).abs());
            for row in column..n {
                worst = worst.max((normal.h()[column * n + row] - h[(row, column)]).abs());
            }
        }
        start += dof;
    }
    Ok(worst / h.amax().max(1.0))
}

fn evaluate(factor: &dyn Factor, values: &Values) -> Result<(DVector<f64>, DMatrix<f64>), GraphError> {
    let m = factor.dim();
    let mut n = 0;
    for &id in factor.variables() {
        n += values.value(id)?.dof();
    }
    let (mut r, mut j) = (DVector::zeros(m), DMatrix::zeros(m, n));
    factor.evaluate(
        values,
        &mut DVectorViewMut::from_slice(r.as_mut_slice(), m),
        Some(&mut DMatrixViewMut::from_slice(j.as_mut_slice(), m, n)),
    )?;
    Ok((r, j))
}
