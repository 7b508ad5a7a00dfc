//! A point seen from a pose.

use motorcade_geometry::lie::so3;
use nalgebra::{DMatrixView, DMatrixViewMut, DVector, DVectorViewMut, Isometry3, Matrix3, Point3, Vector3};

use crate::GraphError;
use crate::factor::{Factor, Terms};
use crate::ids::VariableId;
use crate::information;
use crate::values::Values;

/// Measured position z of a world point p in the frame of a pose `X = world_from_body`.
///
/// `r = X⁻¹ p − z` (3), `∂r/∂[ω, ν] = [(X⁻¹p)^, −I]` (3×6), `∂r/∂p = Rᵀ` (3×3). The point is a variable of R³.
#[derive(Clone, Debug)]
pub struct PoseToPoint {
    variables: [VariableId; 2],
    measurement: Vector3<f64>,
    information: Matrix3<f64>,
}

impl PoseToPoint {
    /// `point` was seen at `point_in_body` from `pose`, with information Ω (3×3).
    pub fn new(
        pose: VariableId,
        point: VariableId,
        point_in_body: Point3<f64>,
        information: Matrix3<f64>,
    ) -> Result<Self, GraphError> {
        information::check(DMatrixView::from_slice(information.as_slice(), 3, 3))?;
        Ok(Self { variables: [pose, point], measurement: point_in_body.coords, information })
    }
}

impl Factor for PoseToPoint {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let pose = values.get::<Isometry3<f64>>(self.variables[0])?;
        let point = values.get::<DVector<f64>>(self.variables[1])?;
        let [x, y, z] = point.as_slice() else {
            return Err(GraphError::WrongType { variable: self.variables[1], expected: "vector of R^3" });
        };
        let in_body = pose.inverse_transform_point(&Point3::new(*x, *y, *z)).coords;
        residual.copy_from(&(in_body - self.measurement));
        if let Some(jacobian) = jacobian {
            jacobian.view_mut((0, 0), (3, 3)).copy_from(&so3::hat(&in_body));
            jacobian.view_mut((0, 3), (3, 3)).copy_from(&-Matrix3::identity());
            let r = pose.rotation.to_rotation_matrix().into_inner();
            jacobian.view_mut((0, 6), (3, 3)).copy_from(&r.transpose());
        }
        Ok(())
    }
}
