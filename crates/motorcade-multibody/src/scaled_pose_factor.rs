//! Camera–vehicle factor whose measured pose depends on a scale shared by the measurements of a track: of the vehicle's size, or
//! of the distances of a source.

use motorcade_geometry::lie::{se3, so3};
use motorcade_graph::{Factor, GraphError, MeasuredPose, Terms, Values, VariableId};
use motorcade_vehicles::PoseObservation;
use nalgebra::{DMatrixViewMut, DVectorViewMut, Isometry3, Matrix6, Vector6};

/// `r = [log R(E); t(E)]` (6), rotation R and translation t of `E = (Z · exp(J (s − s₀)))⁻¹ · C⁻¹ V`: camera C and vehicle V are
/// poses in the world, s (1) the logarithm of the scale, of a size its height \[m\]; Z is the pose measured at s₀, J (6) its
/// derivative.
///
/// Not `log E`, whose translation is turned by half the rotation: errors along the ray (large) would turn the vehicle to reduce
/// errors across it (small).
///
/// The covariance of the factor is that with the scale held; the effect of a wrong scale is the scale variable's.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ScaledPoseFactor {
    variables: [VariableId; 3],
    measurement: Isometry3<f64>,
    scale_derivative: Vector6<f64>,
    at: f64,
    information: Matrix6<f64>,
}

impl ScaledPoseFactor {
    /// Between `[camera, vehicle, scale]`, measured with the scale at `at`; `information` (6×6 `[ω, ν]`) of the pose with the
    /// scale held.
    pub fn new(
        variables: [VariableId; 3],
        observation: &PoseObservation,
        at: f64,
        information: Matrix6<f64>,
    ) -> Self {
        Self {
            variables,
            measurement: *observation.camera_from_vehicle.isometry(),
            scale_derivative: observation.scale_derivative,
            at,
            information,
        }
    }

    /// J (s − s₀).
    fn shift(&self, scale: f64) -> Vector6<f64> {
        self.scale_derivative * (scale - self.at)
    }
}

impl Factor for ScaledPoseFactor {
    fn terms(&self) -> Terms<'_> {
        Terms::new(&self.variables, &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let [camera, vehicle, scale] = self.variables;
        let pose = |id: VariableId| values.get::<Isometry3<f64>>(id);
        let camera_from_vehicle = pose(camera)?.inv_mul(pose(vehicle)?);
        let x = self.shift(values.scalar(scale)?);
        // M = Z⁻¹ C⁻¹ V, E = exp(−x) M
        let m = self.measurement.inv_mul(&camera_from_vehicle);
        let e = se3::exp(&-x) * m;
        let w = so3::log(&e.rotation);
        residual.fixed_rows_mut::<3>(0).copy_from(&w);
        residual.fixed_rows_mut::<3>(3).copy_from(&e.translation.vector);
        if let Some(j) = jacobian {
            let mut second = Matrix6::zeros();
            second.fixed_view_mut::<3, 3>(0, 0).copy_from(&so3::right_jacobian_inverse(&w));
            second.fixed_view_mut::<3, 3>(3, 3).copy_from(e.rotation.to_rotation_matrix().matrix());
            // D = diag(Jr⁻¹(log R), R): ∂r/∂V = D, ∂r/∂C = −D Ad(V⁻¹C)   (6×6 each)
            j.view_mut((0, 6), (6, 6)).copy_from(&second);
            j.view_mut((0, 0), (6, 6)).copy_from(&(-second * se3::adjoint(&camera_from_vehicle.inverse())));
            // exp(−x − Jδ) = exp(−x) exp(−Jδ), x being a multiple of J; hence ∂r/∂s = −D Ad(M⁻¹) J   (6×1)
            j.view_mut((0, 12), (6, 1))
                .copy_from(&(-second * se3::adjoint(&m.inverse()) * self.scale_derivative));
        }
        Ok(())
    }
    fn relative_pose_at(&self, values: &Values) -> Result<Option<MeasuredPose>, GraphError> {
        let shift = self.shift(values.scalar(self.variables[2])?);
        let measurement = self.measurement * se3::exp(&shift);
        Ok(Some(MeasuredPose { measurement, information: self.information }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use motorcade_graph::{Graph, numeric};
    use motorcade_vehicles::{Scaling, Source};

    #[test]
    fn jacobians_match_differences() {
        let mut graph = Graph::new();
        let at = |x: [f64; 6]| se3::exp(&Vector6::from_row_slice(&x));
        let camera = graph.add_variable(at([0.01, -0.02, 0.3, 1.0, 2.0, 0.1]));
        let vehicle = graph.add_variable(at([1.2, 0.1, -1.4, 3.1, 2.2, 12.0]));
        let scale = graph.add_variable(1.62_f64.ln());
        let observation = PoseObservation {
            source: Source::Box,
            camera_from_vehicle: Pose::new(at([1.1, 0.2, -1.5, 2.5, 0.4, 11.0])),
            covariance: Matrix6::identity(),
            scaling: Scaling::Size,
            // A slope of the rotation too.
            scale_derivative: Vector6::new(0.3, -0.2, 0.5, 8.0, -1.0, 0.4),
        };
        let factor =
            ScaledPoseFactor::new([camera, vehicle, scale], &observation, 1.5_f64.ln(), Matrix6::identity());
        assert!(numeric::jacobian_error(&factor, graph.values()).unwrap() < 1e-6);
    }
}
