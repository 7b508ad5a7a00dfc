//! Camera–vehicle factor whose measured pose depends on a scale shared by the measurements of a track: of the vehicle's size, or
//! of the distances of a source.

use motorcade_geometry::lie::{se3, so3};
use motorcade_graph::{Factor, GraphError, MeasuredPose, Terms, Values, VariableId};
use motorcade_vehicles::PoseObservation;
use nalgebra::{DMatrixViewMut, DVectorViewMut, Isometry3, Matrix6, Vector6};

/// `r = [log R(E); t(E)]` (6), rotation R and translation t of `E = (Z · exp(J (s − s₀)))⁻¹ · C⁻¹ V`: camera C and vehicle V are
/// poses in the world, s (1) the logarithm of the scale, of a size its height \[m\]; Z is the pose measured at s₀, J (6) its
/// derivative. With an error c that all measurements of a track share it is `exp(J (s − s₀) + K c)`, K (6) the derivative by it.
///
/// Not `log E`, whose translation is turned by half the rotation: errors along the ray (large) would turn the vehicle to reduce
/// errors across it (small).
///
/// The covariance of the factor is that with the scale held; the effect of a wrong scale is the scale variable's.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ScaledPoseFactor {
    /// Camera, vehicle, scale; the fourth is used `with_common` alone.
    variables: [VariableId; 4],
    measurement: Isometry3<f64>,
    scale_derivative: Vector6<f64>,
    common_derivative: Option<Vector6<f64>>,
    at: f64,
    information: Matrix6<f64>,
}

impl ScaledPoseFactor {
    /// Between `[camera, vehicle, scale]`, measured with the scale at `at`; `information` (6×6 `[ω, ν]`) of the pose with the
    /// scale held.
    pub fn new(
        [camera, vehicle, scale]: [VariableId; 3],
        observation: &PoseObservation,
        at: f64,
        information: Matrix6<f64>,
    ) -> Self {
        Self {
            variables: [camera, vehicle, scale, scale],
            measurement: *observation.camera_from_vehicle.isometry(),
            scale_derivative: observation.scale_derivative,
            common_derivative: None,
            at,
            information,
        }
    }

    /// With the error that all boxes and keypoints of a track share, in its standard deviations. Both derivatives must be translations.
    pub fn with_common(self, common: VariableId, observation: &PoseObservation) -> Self {
        let [camera, vehicle, scale, _] = self.variables;
        let variables = [camera, vehicle, scale, common];
        Self { variables, common_derivative: Some(observation.common_derivative), ..self }
    }

    /// J (s − s₀) + K c.
    fn shift(&self, values: &Values) -> Result<Vector6<f64>, GraphError> {
        let by_scale = self.scale_derivative * (values.scalar(self.variables[2])? - self.at);
        Ok(match &self.common_derivative {
            Some(derivative) => by_scale + derivative * values.scalar(self.variables[3])?,
            None => by_scale,
        })
    }
}

impl Factor for ScaledPoseFactor {
    fn terms(&self) -> Terms<'_> {
        let count = if self.common_derivative.is_some() { 4 } else { 3 };
        Terms::new(&self.variables[..count], &self.information)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let [camera, vehicle, ..] = self.variables;
        let pose = |id: VariableId| values.get::<Isometry3<f64>>(id);
        let camera_from_vehicle = pose(camera)?.inv_mul(pose(vehicle)?);
        let x = self.shift(values)?;
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
            // exp(−x − Jδ) = exp(−x) exp(−Jδ), x being a multiple of J or both translations; hence ∂r/∂s = −D Ad(M⁻¹) J   (6×1)
            let by_shift = -second * se3::adjoint(&m.inverse());
            j.view_mut((0, 12), (6, 1)).copy_from(&(by_shift * self.scale_derivative));
            if let Some(derivative) = &self.common_derivative {
                j.view_mut((0, 13), (6, 1)).copy_from(&(by_shift * derivative));
            }
        }
        Ok(())
    }
    fn relative_pose_at(&self, values: &Values) -> Result<Option<MeasuredPose>, GraphError> {
        let shift = self.shift(values)?;
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
            common_derivative: Vector6::new(0.0, 0.0, 0.0, -2.0, 0.3, -0.1),
        };
        let factor =
            ScaledPoseFactor::new([camera, vehicle, scale], &observation, 1.5_f64.ln(), Matrix6::identity());
        assert!(numeric::jacobian_error(&factor, graph.values()).unwrap() < 1e-6);
        let along = Vector6::new(0.0, 0.0, 0.0, 8.0, -1.0, 0.4);
        let observation = PoseObservation { scale_derivative: along, ..observation };
        let common = graph.add_variable(0.7);
        let factor =
            ScaledPoseFactor::new([camera, vehicle, scale], &observation, 1.5_f64.ln(), Matrix6::identity())
                .with_common(common, &observation);
        assert!(numeric::jacobian_error(&factor, graph.values()).unwrap() < 1e-6);
    }
}
