//! Residuals of prior knowledge: the road, the size and the shape prior.

use motorcade_geometry::lie::so3::hat;
use nalgebra::{Matrix3, SVector, Vector3};

use super::super::model::State;
use super::super::{DOF, MAX_SHAPE};
use super::{Problem, Row, Term};

impl Problem<'_> {
    /// Height over the road, and roll and pitch against it.
    pub(super) fn road_rows(&self, rotation: &Matrix3<f64>, translation: &Vector3<f64>, rows: &mut Vec<Row>) {
        let up = self.up();
        if let Some(road) = &self.road {
            let weight = 1.0 / road.height_sigma_at(self.distance_m);
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(3).copy_from(&(rotation.transpose() * up * weight));
            rows.push(Row { term: Term::Road, r: (up.dot(translation) + road.plane.height_m) * weight, j });
        }
        let sigma =
            self.road.map_or(self.options.level_sigma_rad, |r| r.lean_sigma_rad(&self.options.advanced));
        // u = Rᵀ up is (0, 0, 1) for an upright vehicle; ∂u/∂ω = u^.
        let u = rotation.transpose() * up;
        let du = hat(&u);
        for axis in 0..2 {
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(0).copy_from(&(du.row(axis).transpose() / sigma));
            rows.push(Row { term: Term::Road, r: u[axis] / sigma, j });
        }
    }

    /// Shape prior and size.
    pub fn shape_rows(&self, state: &State, rows: &mut Vec<Row>) {
        for b in 0..self.model.sigmas.len() {
            let mut j = SVector::<f64, DOF>::zeros();
            j[6 + b] = 1.0;
            rows.push(Row { term: Term::Shape, r: state.shape[b], j });
        }
        let Some(size) = &self.size else { return };
        let (mean, sigma) = (size.mean.to_vector(), size.sigma.to_vector());
        let size_of_shape = self.model.size_mean + self.model.size_slope * state.shape;
        for axis in 0..3 {
            let mut j = SVector::<f64, DOF>::zeros();
            let slope = self.model.size_slope.row(axis).transpose() / sigma[axis];
            j.fixed_rows_mut::<MAX_SHAPE>(6).copy_from(&slope);
            rows.push(Row { term: Term::Size, r: (size_of_shape[axis] - mean[axis]) / sigma[axis], j });
        }
    }
}
