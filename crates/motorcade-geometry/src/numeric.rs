//! Numeric derivatives, to check analytic ones in tests.

use nalgebra::{DMatrix, DVector};

/// Step of the differences: the errors of truncation and of rounding are about equal.
const STEP: f64 = 1e-6;

/// Jacobian (m × n) of `f: Rⁿ → Rᵐ` at zero by central differences. `f` takes a step of the n parameters.
///
/// # Errors
/// Those of `f`.
pub fn jacobian<E>(
    parameters: usize,
    mut f: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
) -> Result<DMatrix<f64>, E> {
    let mut columns = Vec::with_capacity(parameters);
    let mut step = DVector::zeros(parameters);
    for k in 0..parameters {
        step[k] = STEP;
        let above = f(&step)?;
        step[k] = -STEP;
        let below = f(&step)?;
        step[k] = 0.0;
        columns.push((above - below) / (2.0 * STEP));
    }
    if columns.is_empty() {
        return Ok(DMatrix::zeros(f(&step)?.len(), 0));
    }
    Ok(DMatrix::from_columns(&columns))
}

/// Largest difference between an analytic Jacobian (m × n) of `f` at zero and [`jacobian`], relative to the larger of 1 and
/// the largest entry; infinite when the sizes do not agree.
///
/// # Errors
/// Those of `f`.
pub fn jacobian_error<E>(
    analytic: &DMatrix<f64>,
    f: impl FnMut(&DVector<f64>) -> Result<DVector<f64>, E>,
) -> Result<f64, E> {
    let numeric = jacobian(analytic.ncols(), f)?;
    if numeric.shape() != analytic.shape() {
        return Ok(f64::INFINITY);
    }
    if numeric.is_empty() {
        return Ok(0.0);
    }
    Ok((&numeric - analytic).amax() / analytic.amax().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn a_right_jacobian_passes_and_a_wrong_one_does_not() {
        let f = |d: &DVector<f64>| {
            let (x, y) = (0.3 + d[0], -0.7 + d[1]);
            Ok::<_, Infallible>(DVector::from_vec(vec![x.sin() * y, x * x, y.exp()]))
        };
        let exact = [-0.7 * 0.3_f64.cos(), 0.3_f64.sin(), 0.6, 0.0, 0.0, (-0.7_f64).exp()];
        let mut analytic = DMatrix::from_row_slice(3, 2, &exact);
        assert!(jacobian_error(&analytic, f).unwrap() < 1e-9);
        analytic[(1, 1)] += 1e-3;
        assert!(jacobian_error(&analytic, f).unwrap() > 5e-4);
        assert_eq!(jacobian_error(&DMatrix::zeros(2, 2), f), Ok(f64::INFINITY));
    }
}
