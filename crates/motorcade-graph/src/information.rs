//! Information matrices: checked on input, repaired only on request.

use nalgebra::{DMatrix, DMatrixView};

use crate::GraphError;

/// Eigenvalues down to this fraction of the largest one below zero count as rounding.
const ROUNDING: f64 = 1e-9;

/// Refuses what is not finite, symmetric and positive semidefinite.
pub fn check(information: DMatrixView<'_, f64>) -> Result<(), GraphError> {
    check_symmetric(information)?;
    // A Cholesky factor proves it in a tenth of the time of the eigenvalues.
    if information.clone_owned().cholesky().is_some() {
        return Ok(());
    }
    let eigenvalues = information.clone_owned().symmetric_eigenvalues();
    let (low, high) = (eigenvalues.min(), eigenvalues.max());
    if low < -ROUNDING * high.abs().max(low.abs()) {
        return Err(GraphError::Information(format!(
            "not positive semidefinite (eigenvalues {low:e} to {high:e}); `clamp` it"
        )));
    }
    Ok(())
}

/// Refuses what is not finite or not symmetric.
pub fn check_symmetric(information: DMatrixView<'_, f64>) -> Result<(), GraphError> {
    if information.nrows() != information.ncols() {
        return Err(GraphError::Information("not square".into()));
    }
    if information.iter().any(|x| !x.is_finite()) {
        return Err(GraphError::Information("holds NaN or infinity".into()));
    }
    let scale = information.amax();
    for j in 0..information.ncols() {
        for i in 0..j {
            if (information[(i, j)] - information[(j, i)]).abs() > ROUNDING * scale {
                return Err(GraphError::Information(format!("not symmetric at ({i}, {j})")));
            }
        }
    }
    Ok(())
}

/// The nearest positive semidefinite matrix where `information` is indefinite, `None` where it is fine as it is.
pub fn clamp(information: DMatrixView<'_, f64>) -> Option<DMatrix<f64>> {
    if information.clone_owned().cholesky().is_some() {
        return None;
    }
    let mut eigen = information.clone_owned().symmetric_eigen();
    if eigen.eigenvalues.min() >= 0.0 {
        return None;
    }
    eigen.eigenvalues.apply(|x| *x = x.max(0.0));
    let repaired = eigen.recompose();
    Some((&repaired + repaired.transpose()) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_matrices_are_named_and_clamped() {
        let mut m = DMatrix::<f64>::identity(3, 3);
        assert!(check(m.as_view()).is_ok() && clamp(m.as_view()).is_none());
        m[(0, 1)] = 0.5;
        assert!(check(m.as_view()).is_err());
        m[(1, 0)] = 0.5;
        assert!(check(m.as_view()).is_ok());
        m[(0, 1)] = 1.5;
        m[(1, 0)] = 1.5;
        assert!(check(m.as_view()).is_err());
        let repaired = clamp(m.as_view()).unwrap();
        assert!(check(repaired.as_view()).is_ok());
        // The positive part is kept: eigenvalue 2.5 along (1, 1, 0)/√2.
        assert!((repaired[(0, 1)] - 1.25).abs() < 1e-12);
        m[(2, 2)] = f64::NAN;
        assert!(check(m.as_view()).is_err());
    }
}
