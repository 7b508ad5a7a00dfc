//! The relative similarity of two Sim(3) variables.

use motorcade_geometry::lie::sim3::Similarity;
use motorcade_geometry::lie::so3;
use nalgebra::{DMatrix, DMatrixViewMut, DVectorViewMut, Matrix3};

use crate::GraphError;
use crate::factor::{Factor, Terms};
use crate::ids::VariableId;
use crate::information;
use crate::values::Values;

/// Measured similarity `Z = first_from_second`.
///
/// `E = Z⁻¹ Xi⁻¹ Xj`, `r = [log R_E, t_E, ln s_E]` (7). With `D = Xi⁻¹ Xj = (s, R, t)`:
/// `J_j = diag(Jr⁻¹(r_ω), s_E R_E, 1)`; `J_i` has rows `[−Jr⁻¹ Rᵀ, 0, 0]`, `Rzᵀ/s_z · [t^, −I, −t]`, `[0, 0, −1]`.
#[derive(Clone, Debug)]
pub struct BetweenSimilarity {
    variables: [VariableId; 2],
    measurement: Similarity,
    information: DMatrix<f64>,
}

impl BetweenSimilarity {
    /// A measurement of `first_from_second` with Ω (7×7) in `[ω, ν, λ]` order.
    pub fn new(
        first: VariableId,
        second: VariableId,
        measurement: Similarity,
        information: DMatrix<f64>,
    ) -> Result<Self, GraphError> {
        if information.nrows() != 7 {
            return Err(GraphError::Size {
                what: "Sim(3) information",
                expected: 7,
                found: information.nrows(),
            });
        }
        information::check(information.as_view())?;
        Ok(Self { variables: [first, second], measurement, information })
    }
}

impl Factor for BetweenSimilarity {
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
        let d = values.get::<Similarity>(i)?.inverse().compose(values.get::<Similarity>(j)?);
        let e = self.measurement.inverse().compose(&d);
        let w = so3::log(&e.rotation);
        residual.rows_mut(0, 3).copy_from(&w);
        residual.rows_mut(3, 3).copy_from(&e.translation);
        residual[6] = e.scale.ln();
        if let Some(jacobian) = jacobian {
            let jr = so3::right_jacobian_inverse(&w);
            let r = d.rotation.to_rotation_matrix().into_inner();
            let z = self.measurement.rotation.inverse().to_rotation_matrix().into_inner()
                / self.measurement.scale;
            let re: Matrix3<f64> = e.rotation.to_rotation_matrix().into_inner() * e.scale;
            jacobian.view_mut((0, 0), (3, 3)).copy_from(&-(jr * r.transpose()));
            jacobian.view_mut((3, 0), (3, 3)).copy_from(&(z * so3::hat(&d.translation)));
            jacobian.view_mut((3, 3), (3, 3)).copy_from(&-z);
            jacobian.view_mut((3, 6), (3, 1)).copy_from(&-(z * d.translation));
            jacobian[(6, 6)] = -1.0;
            jacobian.view_mut((0, 7), (3, 3)).copy_from(&jr);
            jacobian.view_mut((3, 10), (3, 3)).copy_from(&re);
            jacobian[(6, 13)] = 1.0;
        }
        Ok(())
    }
}
