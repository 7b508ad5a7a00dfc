//! One damped Gauss–Newton step of a window: corners and poses are eliminated, what is left is what the window says of the lens.

use motorcade_geometry::robust::RobustKernel;
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Matrix4, Matrix6x3, SMatrix, Vector3, Vector4};

use crate::lens::Lens;
use crate::window::{Corner, Window};

type Matrix2x6 = SMatrix<f64, 2, 6>;
type Matrix4x3 = SMatrix<f64, 4, 3>;

/// A window's equations after elimination; `information · step = −gradient` for the lens.
pub(crate) struct Reduced {
    pub information: Matrix4<f64>,
    pub gradient: Vector4<f64>,
    corners: Vec<CornerBlock>,
    /// Pose step without a step of the lens, and its derivative by the lens.
    pose_step: DVector<f64>,
    pose_by_lens: DMatrix<f64>,
}

struct CornerBlock {
    inverse: Matrix3<f64>,
    gradient: Vector3<f64>,
    by_poses: Vec<(usize, Matrix6x3<f64>)>,
    by_lens: Matrix4x3,
}

/// Derivatives of an observation.
struct Linearised {
    weight: f64,
    residual: nalgebra::Vector2<f64>,
    by_corner: Matrix2x3<f64>,
    by_lens: nalgebra::Matrix2x4<f64>,
    /// By the poses of the view and of the anchor (the negative); absent in the anchor itself.
    by_pose: Option<Matrix2x6>,
}

impl Window {
    /// Linearises at `lens` and eliminates everything but the lens. `None` when the system is singular.
    pub fn reduce(&self, lens: &Lens, kernel: RobustKernel, damping: f64) -> Option<Reduced> {
        let free = 6 * (self.poses.len() - 1);
        let mut poses = DMatrix::<f64>::zeros(free, free);
        let mut poses_lens = DMatrix::<f64>::zeros(free, 4);
        let mut gradient = DVector::<f64>::zeros(free);
        let (mut lens_h, mut lens_g) = (Matrix4::<f64>::zeros(), Vector4::<f64>::zeros());
        let mut blocks = Vec::with_capacity(self.corners.len());
        for corner in &self.corners {
            let mut h = Matrix3::<f64>::zeros();
            let mut block = CornerBlock {
                inverse: Matrix3::zeros(),
                gradient: Vector3::zeros(),
                by_poses: Vec::with_capacity(corner.observations.len()),
                by_lens: Matrix4x3::zeros(),
            };
            for (view, pixel) in &corner.observations {
                let Some(l) = self.linearise(corner, *view, pixel, lens, kernel) else { continue };
                h += l.by_corner.transpose() * l.by_corner * l.weight;
                block.gradient += l.by_corner.transpose() * l.residual * l.weight;
                block.by_lens += l.by_lens.transpose() * l.by_corner * l.weight;
                lens_h += l.by_lens.transpose() * l.by_lens * l.weight;
                lens_g += l.by_lens.transpose() * l.residual * l.weight;
                let Some(by_pose) = l.by_pose else { continue };
                let ends = [(*view, by_pose), (corner.anchor(), -by_pose)];
                for (slot, j) in ends.iter().filter_map(|(v, j)| Some((v.checked_sub(1)?, j))) {
                    let mut g = gradient.fixed_rows_mut::<6>(6 * slot);
                    g += j.transpose() * l.residual * l.weight;
                    let mut cross = poses_lens.fixed_view_mut::<6, 4>(6 * slot, 0);
                    cross += j.transpose() * l.by_lens * l.weight;
                    let by_corner: Matrix6x3<f64> = j.transpose() * l.by_corner * l.weight;
                    match block.by_poses.iter_mut().find(|(s, _)| *s == slot) {
                        Some((_, sum)) => *sum += by_corner,
                        None => block.by_poses.push((slot, by_corner)),
                    }
                    for (other, k) in ends.iter().filter_map(|(v, k)| Some((v.checked_sub(1)?, k))) {
                        let mut sum = poses.fixed_view_mut::<6, 6>(6 * slot, 6 * other);
                        sum += j.transpose() * k * l.weight;
                    }
                }
            }
            for k in 0..3 {
                h[(k, k)] += damping * h[(k, k)] + 1e-12;
            }
            // A corner at infinity that would go beyond it stays there.
            if corner.place.z <= 0.0 && block.gradient.z > 0.0 {
                h[(2, 2)] += 1e12;
            }
            block.inverse = h.try_inverse()?;
            blocks.push(block);
        }
        for k in 0..free {
            poses[(k, k)] += damping * poses[(k, k)] + 1e-9;
        }
        self.hold_length(&mut poses, &mut gradient);
        for block in &blocks {
            let lens_scaled: Matrix4x3 = block.by_lens * block.inverse;
            lens_h -= lens_scaled * block.by_lens.transpose();
            lens_g -= lens_scaled * block.gradient;
            for (slot, cross) in &block.by_poses {
                let scaled: Matrix6x3<f64> = cross * block.inverse;
                let mut g = gradient.fixed_rows_mut::<6>(6 * slot);
                g -= scaled * block.gradient;
                let mut by_lens = poses_lens.fixed_view_mut::<6, 4>(6 * slot, 0);
                by_lens -= scaled * block.by_lens.transpose();
                for (other, other_cross) in &block.by_poses {
                    let mut sum = poses.fixed_view_mut::<6, 6>(6 * slot, 6 * other);
                    sum -= scaled * other_cross.transpose();
                }
            }
        }
        let factor = poses.cholesky()?;
        let pose_step = factor.solve(&-&gradient);
        let pose_by_lens = factor.solve(&-&poses_lens);
        let information = lens_h + poses_lens.transpose() * &pose_by_lens;
        let gradient = lens_g + poses_lens.transpose() * &pose_step;
        Some(Reduced { information, gradient, corners: blocks, pose_step, pose_by_lens })
    }

    /// The distance between the first and the last keyframe is the unit of length.
    fn hold_length(&self, poses: &mut DMatrix<f64>, gradient: &mut DVector<f64>) {
        let last = self.poses.len() - 1;
        let between = self.poses[last].inverse().translation() - self.poses[0].inverse().translation();
        let distance = between.norm();
        if distance <= 0.0 {
            return;
        }
        // The position −Rᵀt moves by −ν in the world when the pose is perturbed on the right.
        let by_translation = -between / distance / self.length;
        let weight = 1e8;
        let residual = distance / self.length - 1.0;
        let slot = 6 * (last - 1) + 3;
        let mut g = gradient.fixed_rows_mut::<3>(slot);
        g += by_translation * residual * weight;
        let mut h = poses.fixed_view_mut::<3, 3>(slot, slot);
        h += by_translation * by_translation.transpose() * weight;
    }

    fn linearise(
        &self,
        corner: &Corner,
        view: usize,
        pixel: &nalgebra::Point2<f64>,
        lens: &Lens,
        kernel: RobustKernel,
    ) -> Option<Linearised> {
        let projected = lens.project(&corner.in_view(&self.poses, view))?;
        let residual = projected.pixel - pixel;
        let weight = kernel.weight(residual.norm_squared());
        let anchor = corner.anchor();
        let (by_corner, by_pose) = if view == anchor {
            let mut by_direction = Matrix3::identity();
            by_direction[(2, 2)] = 0.0;
            (projected.by_point * by_direction, None)
        } else {
            let (from, to) = (&self.poses[anchor], &self.poses[view]);
            let (from_rotation, to_rotation) = (from.rotation_matrix(), to.rotation_matrix());
            let rho = corner.place.z;
            let direction = Vector3::new(corner.place.x, corner.place.y, 1.0);
            let in_world = from_rotation.transpose() * (direction - rho * from.translation());
            let turn = to_rotation * from_rotation.transpose();
            let mut by_place = turn;
            by_place.set_column(2, &(to.translation() - turn * from.translation()));
            let mut by_view = SMatrix::<f64, 3, 6>::zeros();
            by_view.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-to_rotation * in_world.cross_matrix()));
            by_view.fixed_view_mut::<3, 3>(0, 3).copy_from(&(to_rotation * rho));
            (projected.by_point * by_place, Some(projected.by_point * by_view))
        };
        Some(Linearised { weight, residual, by_corner, by_lens: projected.by_lens, by_pose })
    }
}

impl Reduced {
    /// Steps of poses and corners that go with a step of the lens.
    pub fn substitute(&self, lens_step: &Vector4<f64>) -> (DVector<f64>, Vec<Vector3<f64>>) {
        let pose_step = &self.pose_step + &self.pose_by_lens * lens_step;
        let corner = |block: &CornerBlock| {
            let mut rhs = -block.gradient - block.by_lens.transpose() * lens_step;
            for (slot, cross) in &block.by_poses {
                rhs -= cross.tr_mul(&pose_step.fixed_rows::<6>(6 * slot));
            }
            block.inverse * rhs
        };
        let corners = self.corners.iter().map(corner).collect();
        (pose_step, corners)
    }
}
