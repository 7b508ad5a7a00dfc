//! One damped Gauss–Newton step of the bundle adjustment.

use motorcade_geometry::{PinholeCamera, robust::RobustKernel};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

use super::bundle_problem::BundleProblem;
use super::options::BundleOptions;
use super::reprojection::{add_outer, reprojection};

struct PointBlock {
    inverse: Matrix3<f64>,
    gradient: Vector3<f64>,
    /// For every observation from a free pose: its slot and H_pose,point (6×3).
    cross: Vec<(usize, Matrix6x3<f64>)>,
}

impl BundleProblem {
    /// One damped Gauss–Newton step: reduced camera system by the Schur complement, then back-substitution.
    pub(super) fn step(
        &self,
        camera: &PinholeCamera,
        options: &BundleOptions,
        slots: &[Option<usize>],
        free: usize,
        lambda: f64,
    ) -> Option<(DVector<f64>, Vec<Vector3<f64>>)> {
        let kernel = RobustKernel::Cauchy(options.kernel_px);
        let mut diagonal = vec![Matrix6::<f64>::zeros(); free];
        let mut gradient = DVector::<f64>::zeros(6 * free);
        let mut blocks = Vec::with_capacity(self.points.len());
        for (index, (point, observations)) in self.points.iter().zip(&self.observations).enumerate() {
            let (mut hpp, mut gp) = (Matrix3::zeros(), Vector3::zeros());
            let mut cross = Vec::with_capacity(observations.len());
            for s in observations {
                let Some((r, j_pose, j_point)) = reprojection(camera, &self.poses[s.pose], point, &s.pixel)
                else {
                    continue;
                };
                let w = kernel.weight(r.norm_squared());
                add_outer(&mut hpp, &j_point, &j_point, w);
                add_outer(&mut gp, &j_point, &r, w);
                if let Some(slot) = slots[s.pose] {
                    let (mut by_both, mut g) = (Matrix6x3::zeros(), Vector6::zeros());
                    add_outer(&mut diagonal[slot], &j_pose, &j_pose, w);
                    add_outer(&mut by_both, &j_pose, &j_point, w);
                    add_outer(&mut g, &j_pose, &r, w);
                    let mut sum = gradient.fixed_rows_mut::<6>(6 * slot);
                    sum += g;
                    cross.push((slot, by_both));
                }
            }
            if let Some(road_point) = self.road_points.get(index).copied().flatten() {
                let (r, w, j_pose, j_point) =
                    road_point.linearise(&self.poses[road_point.pose], point, options);
                hpp += j_point * j_point.transpose() * w;
                gp += j_point * (r * w);
                if let Some(slot) = slots[road_point.pose] {
                    diagonal[slot] += j_pose * j_pose.transpose() * w;
                    let mut sum = gradient.fixed_rows_mut::<6>(6 * slot);
                    sum += j_pose * (r * w);
                    let by_both: Matrix6x3<f64> = j_pose * j_point.transpose() * w;
                    // The keyframe observed the point: its block exists.
                    match cross.iter_mut().find(|(s, _)| *s == slot) {
                        Some((_, block)) => *block += by_both,
                        None => cross.push((slot, by_both)),
                    }
                }
            }
            for k in 0..3 {
                hpp[(k, k)] += lambda * hpp[(k, k)] + 1e-12;
            }
            // A point without constraints stays where it is.
            let inverse = hpp.try_inverse().unwrap_or_else(Matrix3::zeros);
            blocks.push(PointBlock { inverse, gradient: gp, cross });
        }
        let mut reduced = DMatrix::<f64>::zeros(6 * free, 6 * free);
        for (slot, h) in diagonal.iter().enumerate() {
            let mut damped = *h;
            for k in 0..6 {
                damped[(k, k)] += lambda * h[(k, k)] + 1e-9;
            }
            reduced.fixed_view_mut::<6, 6>(6 * slot, 6 * slot).copy_from(&damped);
        }
        self.add_lengths(slots, &mut reduced, &mut gradient, options);
        for block in &blocks {
            for (a, (slot_a, cross_a)) in block.cross.iter().enumerate() {
                let scaled: Matrix6x3<f64> = cross_a * block.inverse;
                let mut g = gradient.fixed_rows_mut::<6>(6 * slot_a);
                g -= scaled * block.gradient;
                for (slot_b, cross_b) in &block.cross[..=a] {
                    if slot_a >= slot_b {
                        subtract_product(&mut reduced, [*slot_a, *slot_b], &scaled, cross_b);
                    } else {
                        subtract_product(&mut reduced, [*slot_b, *slot_a], cross_b, &scaled);
                    }
                }
            }
        }
        // Only the lower triangle is filled; Cholesky reads no other part.
        let pose_steps = reduced.cholesky()?.solve(&-gradient);
        let point_steps = blocks.iter().map(|block| {
            let mut rhs = -block.gradient;
            for (slot, cross) in &block.cross {
                rhs -= cross.tr_mul(&pose_steps.fixed_rows::<6>(6 * slot));
            }
            block.inverse * rhs
        });
        let point_steps: Vec<Vector3<f64>> = point_steps.collect();
        let finite = pose_steps.iter().all(|v| v.is_finite())
            && point_steps.iter().all(|p| p.iter().all(|v| v.is_finite()));
        finite.then_some((pose_steps, point_steps))
    }

    /// Adds the lengths to the camera system (its lower triangle) and its gradient.
    fn add_lengths(
        &self,
        slots: &[Option<usize>],
        reduced: &mut DMatrix<f64>,
        gradient: &mut DVector<f64>,
        options: &BundleOptions,
    ) {
        let kernel = RobustKernel::Cauchy(options.length_kernel);
        for length in &self.lengths {
            let Some((residual, by_from, by_to)) = length.linearise(&self.poses) else { continue };
            let w = options.pixel_sigma_px * options.pixel_sigma_px * kernel.weight(residual * residual);
            let ends = [(slots[length.from], by_from), (slots[length.to], by_to)];
            for (row, j_row) in ends.iter().filter_map(|(s, j)| Some(((*s)?, j))) {
                let mut g = gradient.fixed_rows_mut::<6>(6 * row);
                g += j_row * (w * residual);
                for (column, j_column) in ends.iter().filter_map(|(s, j)| Some(((*s)?, j))) {
                    if row >= column {
                        let mut block = reduced.fixed_view_mut::<6, 6>(6 * row, 6 * column);
                        block += j_row * j_column.transpose() * w;
                    }
                }
            }
        }
    }
}

/// `m -= a bᵀ` in the 6×6 block of two slots, unrolled for small blocks.
fn subtract_product(m: &mut DMatrix<f64>, [row, column]: [usize; 2], a: &Matrix6x3<f64>, b: &Matrix6x3<f64>) {
    let mut block = m.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    for c in 0..6 {
        let (b0, b1, b2) = (b[(c, 0)], b[(c, 1)], b[(c, 2)]);
        for r in 0..6 {
            block[(r, c)] -= a[(r, 0)] * b0 + a[(r, 1)] * b1 + a[(r, 2)] * b2;
        }
    }
}
