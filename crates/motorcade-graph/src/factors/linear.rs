//! Prior from marginalised variables.

use nalgebra::{DMatrix, DMatrixViewMut, DVector, DVectorView, DVectorViewMut};

use crate::GraphError;
use crate::factor::{Factor, Terms};
use crate::ids::VariableId;
use crate::manifold::{Manifold, Value};
use crate::values::Values;

/// A dense quadratic over several variables, fixed at the values `x̄` it was computed at.
///
/// With `d = x̄.local(x)` the stacked tangents, `r = d + m` and `cost = rᵀ Λ r`; the Jacobian is block diagonal with
/// [`Manifold::local_jacobian`]. Λ stays as it was where it was made.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct LinearPrior {
    variables: Vec<VariableId>,
    at: Vec<Value>,
    offset: DVector<f64>,
    information: DMatrix<f64>,
}

impl LinearPrior {
    /// Prior at `at` with information Λ and offset m (Σ dof each).
    pub fn new(
        variables: Vec<VariableId>,
        at: Vec<Value>,
        offset: DVector<f64>,
        information: DMatrix<f64>,
    ) -> Result<Self, GraphError> {
        let dof: usize = at.iter().map(Manifold::dof).sum();
        if at.len() != variables.len() {
            return Err(GraphError::Size {
                what: "prior values",
                expected: variables.len(),
                found: at.len(),
            });
        }
        for found in [offset.len(), information.nrows(), information.ncols()] {
            if found != dof {
                return Err(GraphError::Size { what: "dense prior", expected: dof, found });
            }
        }
        Ok(Self { variables, at, offset, information })
    }

    fn write_residual(&self, values: &Values, out: &mut [f64]) -> Result<(), GraphError> {
        let mut start = 0;
        for (&id, at) in self.variables.iter().zip(&self.at) {
            let end = start + at.dof();
            at.local(values.value(id)?, &mut out[start..end]);
            start = end;
        }
        for (x, m) in out.iter_mut().zip(self.offset.iter()) {
            *x += m;
        }
        Ok(())
    }
}

impl Factor for LinearPrior {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let mut r = vec![0.0; self.dim()];
        self.write_residual(values, &mut r)?;
        residual.copy_from(&DVectorView::from_slice(&r, r.len()));
        if let Some(jacobian) = jacobian {
            let mut start = 0;
            for (&id, at) in self.variables.iter().zip(&self.at) {
                let n = at.dof();
                let block = at.local_jacobian(values.value(id)?);
                jacobian.view_mut((start, start), (n, n)).copy_from(&block);
                start += n;
            }
        }
        Ok(())
    }
}
