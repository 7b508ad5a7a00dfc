//! The relative pose of two SE(2) variables.

use nalgebra::{DMatrixView, DMatrixViewMut, DVectorViewMut, Isometry2, Matrix3, Vector2};

use crate::GraphError;
use crate::factor::{Factor, Terms};
use crate::ids::VariableId;
use crate::information;
use crate::values::Values;

/// Measured motion `Z = first_from_second` in the plane.
///
/// `E = Z⁻¹ Xi⁻¹ Xj`, `r = [θ(E), t(E)]` (3). With `D = Xi⁻¹ Xj = (R, t)` and `S = [[0, −1], [1, 0]]`:
/// `J_j = diag(1, R_E)`, `J_i = [[−1, 0], [−Rzᵀ S t, −Rzᵀ]]` (3×3 each).
#[derive(Clone, Debug)]
pub struct BetweenPlane {
    variables: [VariableId; 2],
    measurement: Isometry2<f64>,
    information: Matrix3<f64>,
}

impl BetweenPlane {
    /// A measurement of `first_from_second` with Ω in `[θ, x, y]` order.
    pub fn new(
        first: VariableId,
        second: VariableId,
        measurement: Isometry2<f64>,
        information: Matrix3<f64>,
    ) -> Result<Self, GraphError> {
        information::check(DMatrixView::from_slice(information.as_slice(), 3, 3))?;
        Ok(Self { variables: [first, second], measurement, information })
    }
}

impl Factor for BetweenPlane {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let [i, j] = self.variables;
        let d = values.get::<Isometry2<f64>>(i)?.inv_mul(values.get::<Isometry2<f64>>(j)?);
        let e = self.measurement.inv_mul(&d);
        residual[0] = e.rotation.angle();
        residual[1] = e.translation.x;
        residual[2] = e.translation.y;
        if let Some(jacobian) = jacobian {
            let r = e.rotation.to_rotation_matrix();
            let z = self.measurement.rotation.inverse();
            let zt = z.to_rotation_matrix();
            let turned = z * Vector2::new(-d.translation.y, d.translation.x);
            jacobian[(0, 0)] = -1.0;
            jacobian[(0, 3)] = 1.0;
            for k in 0..2 {
                jacobian[(1 + k, 0)] = -turned[k];
                for c in 0..2 {
                    jacobian[(1 + k, 1 + c)] = -zt[(k, c)];
                    jacobian[(1 + k, 4 + c)] = r[(k, c)];
                }
            }
        }
        Ok(())
    }
    fn relative_plane(&self) -> Option<&Isometry2<f64>> {
        Some(&self.measurement)
    }
}
