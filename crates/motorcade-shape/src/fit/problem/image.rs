//! Residuals of keypoints (the keypoint term of the paper's equations 7 and 8).

use nalgebra::{Matrix3, RowVector3, SMatrix, Vector2, Vector3};

use super::super::model::State;
use super::super::{DOF, MAX_SHAPE};
use super::{NEAREST_M, Problem, Row, Term};

impl Problem<'_> {
    /// Image of a model point and its Jacobian (2×14) \[px\]; `None` behind the camera.
    fn image(
        &self,
        point: usize,
        state: &State,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, SMatrix<f64, 2, DOF>)> {
        let model_point = &self.model.points[point];
        let in_vehicle = model_point.at(&state.shape);
        let p = rotation * in_vehicle + translation;
        if p.z < NEAREST_M {
            return None;
        }
        let (iz, c) = (1.0 / p.z, self.camera);
        let pixel = Vector2::new(c.fx * p.x * iz + c.cx, c.fy * p.y * iz + c.cy);
        // ∂u/∂p (2×3), ∂p/∂[ω, ν, shape] = R [−X^, I, V] (3×14)
        let du_dp = [[c.fx * iz, -c.fx * p.x * iz * iz], [c.fy * iz, -c.fy * p.y * iz * iz]];
        let mut j = SMatrix::<f64, 2, DOF>::zeros();
        for axis in 0..2 {
            // A row of ∂u/∂X; its product with X^ is a cross product with X.
            let by_x: RowVector3<f64> =
                rotation.row(axis) * du_dp[axis][0] + rotation.row(2) * du_dp[axis][1];
            let by_turn = in_vehicle.transpose().cross(&by_x);
            for k in 0..3 {
                (j[(axis, k)], j[(axis, 3 + k)]) = (by_turn[k], by_x[k]);
            }
            for b in 0..MAX_SHAPE {
                let v = &model_point.basis;
                j[(axis, 6 + b)] = by_x[0] * v[(0, b)] + by_x[1] * v[(1, b)] + by_x[2] * v[(2, b)];
            }
        }
        Some((pixel, j))
    }

    pub(super) fn keypoint_rows(
        &self,
        state: &State,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
        rows: &mut Vec<Row>,
    ) -> bool {
        let spread_px =
            Vector2::new(self.camera.fx, self.camera.fy) * (self.options.keypoint_sigma_m / self.distance_m);
        for m in &self.measured {
            let Some((pixel, j)) = self.image(m.point, state, rotation, translation) else { return false };
            for axis in 0..2 {
                let weight = 1.0 / (m.variance[axis] + spread_px[axis].powi(2)).sqrt();
                rows.push(Row {
                    term: Term::Keypoint(m.index),
                    r: (pixel[axis] - m.pixel[axis]) * weight,
                    j: j.row(axis).transpose() * weight,
                });
            }
        }
        true
    }
}
