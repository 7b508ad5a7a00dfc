//! Priors of single variables.

use motorcade_geometry::lie::se3;
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector, DVectorViewMut, Isometry3, Matrix6};

use crate::GraphError;
use crate::factor::{Factor, Terms};
use crate::ids::VariableId;
use crate::information;
use crate::values::Values;

/// `r = log(Z⁻¹ X)` (6), `J = Jr⁻¹(r)` (6×6).
#[derive(Clone, Debug)]
pub struct PosePrior {
    variables: [VariableId; 1],
    measurement: Isometry3<f64>,
    information: Matrix6<f64>,
}

impl PosePrior {
    /// The pose is `measurement`, with Ω in `[ω, ν]` order.
    pub fn new(
        variable: VariableId,
        measurement: Isometry3<f64>,
        information: Matrix6<f64>,
    ) -> Result<Self, GraphError> {
        information::check(DMatrixView::from_slice(information.as_slice(), 6, 6))?;
        Ok(Self { variables: [variable], measurement, information })
    }
}

impl Factor for PosePrior {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let r = se3::log(&self.measurement.inv_mul(values.get::<Isometry3<f64>>(self.variables[0])?));
        residual.copy_from(&r);
        if let Some(jacobian) = jacobian {
            jacobian.copy_from(&se3::right_jacobian_inverse(&r));
        }
        Ok(())
    }
}

/// `r = x − z` (n), `J = I`, for a variable of R^n.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct VectorPrior {
    variables: [VariableId; 1],
    measurement: DVector<f64>,
    information: DMatrix<f64>,
}

impl VectorPrior {
    /// The vector is `measurement`, with information Ω (n×n).
    pub fn new(
        variable: VariableId,
        measurement: DVector<f64>,
        information: DMatrix<f64>,
    ) -> Result<Self, GraphError> {
        let (expected, found) = (measurement.len(), information.nrows());
        if expected != found {
            return Err(GraphError::Size { what: "vector prior's information", expected, found });
        }
        information::check(information.as_view())?;
        Ok(Self { variables: [variable], measurement, information })
    }
}

impl Factor for VectorPrior {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let x = values.get::<DVector<f64>>(self.variables[0])?;
        if x.len() != self.measurement.len() {
            let (expected, found) = (self.measurement.len(), x.len());
            return Err(GraphError::Size { what: "vector of a prior", expected, found });
        }
        residual.copy_from(&(x - &self.measurement));
        if let Some(jacobian) = jacobian {
            jacobian.fill_with_identity();
        }
        Ok(())
    }
}
