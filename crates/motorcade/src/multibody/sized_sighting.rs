//! Camera–vehicle factor whose measured pose depends on the vehicle's size, which all views of a track share.

use motorcade_geometry::lie::se3;
use motorcade_graph::{Factor, GraphError, Values, VariableId};
use motorcade_vehicles::{Dimensions, Sighting};
use nalgebra::{
    DMatrixView, DMatrixViewMut, DVector, DVectorViewMut, Isometry3, Matrix6, Matrix6x3, Vector3, Vector6,
};

/// `r = log((Z · exp(J (s − s₀)))⁻¹ · C⁻¹ V)` (6): camera C and vehicle V are poses in the world, s (3) the vehicle's length,
/// width and height \[m\]; Z is the pose measured for a vehicle of size s₀, J (6×3) its derivative by the size.
///
/// The covariance of the factor is that with the size held: what a wrong size does to all views alike is not in it.
#[derive(Clone, Debug)]
pub struct SizedSighting {
    variables: [VariableId; 3],
    measurement: Isometry3<f64>,
    by_size: Matrix6x3<f64>,
    at_size: Vector3<f64>,
    information: Matrix6<f64>,
}

impl SizedSighting {
    /// Between `[camera, vehicle, size]`; `information` (6×6 `[ω, ν]`) of the pose with the size held.
    pub fn new(
        variables: [VariableId; 3],
        sighting: &Sighting,
        at_size: &Dimensions,
        information: Matrix6<f64>,
    ) -> Self {
        Self {
            variables,
            measurement: *sighting.camera_from_vehicle.isometry(),
            by_size: sighting.by_size,
            at_size: at_size.to_vector(),
            information,
        }
    }

    /// The pose measured if the vehicle has this size, and its information.
    pub fn at(&self, size: &Vector3<f64>) -> (Isometry3<f64>, Matrix6<f64>) {
        (self.measurement * se3::exp(&self.shift(size)), self.information)
    }

    /// Camera, vehicle, size.
    pub fn nodes(&self) -> [VariableId; 3] {
        self.variables
    }

    /// J (s − s₀).
    fn shift(&self, size: &Vector3<f64>) -> Vector6<f64> {
        self.by_size * (size - self.at_size)
    }
}

impl Factor for SizedSighting {
    fn variables(&self) -> &[VariableId] {
        &self.variables
    }
    fn dim(&self) -> usize {
        6
    }
    fn information(&self) -> DMatrixView<'_, f64> {
        DMatrixView::from_slice(self.information.as_slice(), 6, 6)
    }
    fn evaluate(
        &self,
        values: &Values,
        residual: &mut DVectorViewMut<'_, f64>,
        jacobian: Option<&mut DMatrixViewMut<'_, f64>>,
    ) -> Result<(), GraphError> {
        let [camera, vehicle, size] = self.variables;
        let pose = |id: VariableId| values.get::<Isometry3<f64>>(id);
        let camera_from_vehicle = pose(camera)?.inv_mul(pose(vehicle)?);
        let size = values.get::<DVector<f64>>(size)?;
        let [length, width, height] = [0, 1, 2].map(|k| size.get(k).copied().unwrap_or(f64::NAN));
        let x = self.shift(&Vector3::new(length, width, height));
        // M = Z⁻¹ C⁻¹ V, E = exp(−x) M
        let m = self.measurement.inv_mul(&camera_from_vehicle);
        let r = se3::log(&(se3::exp(&-x) * m));
        residual.copy_from(&r);
        if let Some(j) = jacobian {
            let second = se3::right_jacobian_inverse(&r);
            // ∂r/∂V = Jr⁻¹(r), ∂r/∂C = −Jr⁻¹(r) Ad(V⁻¹C)   (6×6 each)
            j.view_mut((0, 6), (6, 6)).copy_from(&second);
            j.view_mut((0, 0), (6, 6)).copy_from(&(-second * se3::adjoint(&camera_from_vehicle.inverse())));
            // exp(−x − Jδ) = exp(−x) exp(−Jr(−x) Jδ), hence ∂r/∂s = −Jr⁻¹(r) Ad(M⁻¹) Jr(−x) J   (6×3)
            let turned = se3::right_jacobian_inverse(&-x).lu().solve(&self.by_size);
            let turned = turned.unwrap_or(self.by_size);
            j.view_mut((0, 12), (6, 3)).copy_from(&(-second * se3::adjoint(&m.inverse()) * turned));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use motorcade_graph::{Graph, numeric};
    use motorcade_vehicles::Source;

    #[test]
    fn jacobians_match_differences() {
        let mut graph = Graph::new();
        let at = |x: [f64; 6]| se3::exp(&Vector6::from_row_slice(&x));
        let camera = graph.add_variable(at([0.01, -0.02, 0.3, 1.0, 2.0, 0.1]));
        let vehicle = graph.add_variable(at([1.2, 0.1, -1.4, 3.1, 2.2, 12.0]));
        let size = graph.add_variable(DVector::from_row_slice(&[4.4, 1.75, 1.62]));
        let sighting = Sighting {
            source: Source::Box,
            camera_from_vehicle: Pose::new(at([1.1, 0.2, -1.5, 2.5, 0.4, 11.0])),
            covariance: Matrix6::identity(),
            // A slope of the heading too: keypoints have one.
            by_size: Matrix6x3::from_fn(|r, c| 0.3 * (r as f64 - 2.0) - 0.7 * c as f64 + 0.4),
        };
        let at_size = Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 };
        let factor = SizedSighting::new([camera, vehicle, size], &sighting, &at_size, Matrix6::identity());
        assert!(numeric::jacobian_error(&factor, graph.values()).unwrap() < 1e-6);
    }
}
