//! Residuals of visibility: a point on a face turned away should be missing, one on a face turned to the camera found.

use motorcade_geometry::lie::so3::hat;
use nalgebra::{Matrix3, RowVector3, SVector};

use super::super::model::State;
use super::super::{DOF, MAX_SHAPE};
use super::{Problem, Row, Term};
use crate::view::facing;

impl Problem<'_> {
    pub(super) fn visibility_rows(&self, state: &State, rotation: &Matrix3<f64>, rows: &mut Vec<Row>) {
        if !self.options.visibility {
            return;
        }
        let advanced = &self.options.advanced;
        // Keypoints of denser layouts are not independent.
        let share = (advanced.visibility_points / self.model.keypoints as f64).min(1.0);
        let camera_in_vehicle = -(rotation.transpose() * state.camera_from_vehicle.translation());
        let mut push = |point: usize, found: bool| {
            let to_camera = camera_in_vehicle - self.model.points[point].at(&state.shape);
            let (cosine, Some(face)) = facing(&self.model.faces[point], &to_camera) else { return };
            // Positive where observation and face disagree.
            let r = if found { -cosine } else { cosine } / advanced.visibility_sigma;
            if r <= 0.0 {
                return;
            }
            // With o the camera in the vehicle and v the unit vector from the point X to it:
            // ∂c/∂o = −∂c/∂X = nᵀ(I − v vᵀ)/|o − X|, ∂o/∂[ω, ν] = [o^, −I], ∂X/∂shape = V.
            let distance = to_camera.norm();
            let v = to_camera / distance;
            let dc_do: RowVector3<f64> = (face - v * v.dot(&face)).transpose() / distance;
            let slope = if found { -1.0 } else { 1.0 } / advanced.visibility_sigma;
            let mut j = SVector::<f64, DOF>::zeros();
            j.fixed_rows_mut::<3>(0).copy_from(&((dc_do * hat(&camera_in_vehicle)).transpose() * slope));
            j.fixed_rows_mut::<3>(3).copy_from(&(-dc_do.transpose() * slope));
            let by_shape = -dc_do * self.model.points[point].basis * slope;
            j.fixed_rows_mut::<MAX_SHAPE>(6).copy_from(&by_shape.transpose());
            let most =
                if found { advanced.visible_behind_cost } else { advanced.missing_in_front_cost } * share;
            rows.push(Row { term: Term::Visibility(most), r, j });
        };
        self.measured.iter().for_each(|m| push(m.point, true));
        for point in &self.missing {
            // Points outside the image are always missing.
            let p =
                state.camera_from_vehicle.transform_point(&self.model.points[*point].at(&state.shape).into());
            if self.camera.project(&p).is_some_and(|pixel| self.camera.contains(&pixel, 0.0)) {
                push(*point, false);
            }
        }
    }
}
