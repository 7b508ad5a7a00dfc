//! What is left of variables that were marginalised.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector, DVectorView, DVectorViewMut};

use crate::GraphError;
use crate::factor::{Factor, Normal};
use crate::manifold::{Manifold, Value};
use crate::values::{Values, VariableId};

/// A dense quadratic over several variables, fixed at the values `x̄` it was computed at.
///
/// With `d = x ⊟ x̄` the stacked tangents, `cost = (d + m)ᵀ Λ (d + m)` and the Jacobian is taken as I: the
/// linearisation stays where it was made (first-estimate Jacobians), so repeated marginalisation stays consistent.
#[derive(Clone, Debug)]
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
    fn variables(&self) -> &[VariableId] {
        &self.variables
    }
    fn dim(&self) -> usize {
        self.offset.len()
    }
    fn information(&self) -> DMatrixView<'_, f64> {
        self.information.as_view()
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
            jacobian.fill_with_identity();
        }
        Ok(())
    }
    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        let mut r = DVector::zeros(self.dim());
        self.write_residual(values, r.as_mut_slice())?;
        let g = &self.information * &r;
        out.h_mut().copy_from_slice(self.information.as_slice());
        out.g_mut().copy_from_slice(g.as_slice());
        Ok(r.dot(&g))
    }
}
