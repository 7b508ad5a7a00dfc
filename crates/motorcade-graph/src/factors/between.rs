//! The relative pose of two SE(3) variables.

use nalgebra::{DMatrixView, DMatrixViewMut, DVectorViewMut, Isometry3, Matrix6};

use super::pose_error::{self, PoseError};
use super::pose_residual::PoseResidual;
use crate::GraphError;
use crate::factor::{Factor, Normal, RelativePose, Terms};
use crate::ids::VariableId;
use crate::information;
use crate::values::Values;

/// Measured motion `Z = first_from_second` between two poses `X = world_from_body`.
///
/// ```text
/// E   = Z⁻¹ Xi⁻¹ Xj                       r = log(E) or [q_xyz(E), t(E)]     (6)
/// J_j = ∂r/∂δ_j = Jr⁻¹(r)                 or [[½(q_w I + q^), 0], [0, R_E]]   (6×6)
/// J_i = ∂r/∂δ_i = −J_j · Ad(Xj⁻¹ Xi)                                          (6×6)
/// ```
///
/// H needs one congruence `A = J_jᵀ Ω J_j` and the adjoint: `H_jj = A`, `H_ji = −A·Ad`, `H_ii = Adᵀ·A·Ad`.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Between {
    variables: [VariableId; 2],
    measurement: Isometry3<f64>,
    information: Matrix6<f64>,
    residual: PoseResidual,
}

impl Between {
    /// A measurement of `first_from_second` with information Ω in `[ω, ν]` order, which must be symmetric positive
    /// semidefinite.
    pub fn new(
        first: VariableId,
        second: VariableId,
        measurement: Isometry3<f64>,
        information: Matrix6<f64>,
    ) -> Result<Self, GraphError> {
        information::check(DMatrixView::from_slice(information.as_slice(), 6, 6))?;
        Ok(Self { variables: [first, second], measurement, information, residual: PoseResidual::Log })
    }

    /// The same with another residual.
    #[must_use]
    pub fn with_residual(self, residual: PoseResidual) -> Self {
        Self { residual, ..self }
    }

    /// Ω scaled.
    pub fn scale_information(&mut self, factor: f64) {
        self.information *= factor;
    }

    /// The measurement at the poses in `values`.
    #[inline]
    fn at<'a>(&'a self, values: &'a Values) -> Result<PoseError<'a>, GraphError> {
        let [i, j] = self.variables;
        Ok(PoseError {
            first: values.get::<Isometry3<f64>>(i)?,
            second: values.get::<Isometry3<f64>>(j)?,
            measurement: &self.measurement,
            information: &self.information.data.0,
            residual: self.residual,
        })
    }
}

impl Factor for Between {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }

    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let at = self.at(values)?;
        let Some(jacobian) = jacobian else {
            let (w, v) = pose_error::residual(&at);
            residual.copy_from_slice(&[w[0], w[1], w[2], v[0], v[1], v[2]]);
            return Ok(());
        };
        let (w, v, first, second) = pose_error::linearise(&at);
        residual.copy_from_slice(&[w[0], w[1], w[2], v[0], v[1], v[2]]);
        jacobian.view_mut((0, 6), (6, 6)).copy_from(&second);
        jacobian.view_mut((0, 0), (6, 6)).copy_from(&first);
        Ok(())
    }

    fn squared_norm(&self, values: &Values) -> Result<f64, GraphError> {
        Ok(pose_error::squared_norm(&self.at(values)?))
    }

    fn normal_equations(&self, values: &Values, out: &mut Normal) -> Result<f64, GraphError> {
        let at = self.at(values)?;
        let found = out.size();
        let Some((g, h)) = out.chunks_mut() else {
            return Err(GraphError::Size { what: "tangent of two poses", expected: 12, found });
        };
        Ok(pose_error::normal_equations(&at, g, h))
    }

    fn relative_pose(&self) -> Option<RelativePose<'_>> {
        Some(RelativePose { measurement: &self.measurement, information: &self.information })
    }
}
