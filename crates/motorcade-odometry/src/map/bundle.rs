//! Windowed bundle adjustment: keyframe poses and points, Schur complement on the points, Levenberg–Marquardt.
//!
//! Minimises `Σ ρ(‖π(T_k X_i) − x_ki‖²)` over the free poses `T_k = camera_from_world` (right perturbation `[ω, ν]`) and
//! points `X_i`. Fixed poses hold the gauge: seven degrees of freedom, so at least two poses must be fixed.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::Kernel};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Matrix6x3, Point2, Point3, Vector3, Vector6};

use super::pose_only::{add_outer, reprojection};
use super::road_point::OnRoad;

/// One sighting of a point from a pose, by index.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Index of the pose.
    pub pose: usize,
    /// Where the point was seen \[px\].
    pub pixel: Point2<f64>,
}

/// The problem; solved in place.
#[derive(Clone, Debug, Default)]
pub struct BundleProblem {
    /// `camera_from_world` of every keyframe.
    pub poses: Vec<Pose<Camera, World>>,
    /// Which poses stay.
    pub fixed: Vec<bool>,
    /// Points in the world.
    pub points: Vec<Point3<f64>>,
    /// Sightings of each point.
    pub sightings: Vec<Vec<Sighting>>,
    /// For each point whether it lies on the road, and where that is; may be left empty.
    pub on_road: Vec<Option<OnRoad>>,
    /// What the road says of distances between poses.
    pub lengths: Vec<Length>,
}

/// A soft distance between the centres of two poses, by index: residual `(ln ‖c_to − c_from‖ − log_length) / sigma`.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    /// Earlier pose.
    pub from: usize,
    /// Later pose.
    pub to: usize,
    /// Logarithm of the distance.
    pub log_length: f64,
    /// Standard deviation of that logarithm.
    pub sigma: f64,
}

/// Noise of a tracked corner \[px\]: what makes one unit of a length's residual as costly as one of a sighting.
pub(crate) const PIXEL_SIGMA_PX: f64 = 0.5;
/// Lengths beyond twice their standard deviation lose weight: a speed bump, a plane that was none.
const LENGTH_KERNEL: Kernel = Kernel::Cauchy(2.0);

impl Length {
    /// Residual and its Jacobians by the two poses (1×6 each, right perturbation `[ω, ν]` of `camera_from_world`). `None`
    /// where the centres coincide.
    fn linearise(&self, poses: &[CameraFromWorld]) -> Option<(f64, Vector6<f64>, Vector6<f64>)> {
        let centre = |k: usize| poses[k].inverse().translation();
        let (a, b) = (centre(self.from), centre(self.to));
        let between = b - a;
        let length = between.norm();
        if length < 1e-9 {
            return None;
        }
        let along = between / (length * length * self.sigma);
        // c = −(T exp δ)⁻¹·0  ⇒  ∂c/∂ω = c^, ∂c/∂ν = −I
        let by = |c: &Vector3<f64>, sign: f64| {
            let turn = along.cross(c) * sign;
            let shift = -along * sign;
            Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
        };
        Some(((length.ln() - self.log_length) / self.sigma, by(&a, -1.0), by(&b, 1.0)))
    }

    fn cost(&self, poses: &[CameraFromWorld]) -> f64 {
        let residual = self.linearise(poses).map_or(0.0, |(r, _, _)| r);
        PIXEL_SIGMA_PX * PIXEL_SIGMA_PX * LENGTH_KERNEL.cost(residual * residual)
    }
}

/// Limits of the solver.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BundleOptions {
    /// Iterations at most.
    pub max_iterations: usize,
    /// Scale of the Cauchy kernel \[px\]: the noise of a tracked corner.
    pub kernel_px: f64,
    /// Ends when the cost falls by less than this fraction.
    pub relative_decrease: f64,
}

impl Default for BundleOptions {
    fn default() -> Self {
        Self { max_iterations: 8, kernel_px: 1.0, relative_decrease: 1e-4 }
    }
}

/// What the solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BundleReport {
    /// Iterations taken.
    pub iterations: usize,
    /// Robust cost before \[px²\].
    pub initial_cost: f64,
    /// Robust cost after \[px²\].
    pub final_cost: f64,
}

type CameraFromWorld = Pose<Camera, World>;

struct PointBlock {
    inverse: Matrix3<f64>,
    gradient: Vector3<f64>,
    /// For every sighting from a free pose: its slot and H_pose,point (6×3).
    cross: Vec<(usize, Matrix6x3<f64>)>,
}

impl BundleProblem {
    /// Robust cost \[px²\]; a sighting from behind counts as a far outlier.
    fn cost(
        &self,
        camera: &PinholeCamera,
        kernel: Kernel,
        poses: &[CameraFromWorld],
        points: &[Point3<f64>],
    ) -> f64 {
        const BEHIND_PX: f64 = 100.0;
        let one = |point: &Point3<f64>, s: &Sighting| {
            let projected = camera.project(&poses[s.pose].transform_point(point));
            kernel.cost(projected.map_or(BEHIND_PX * BEHIND_PX, |p| (p - s.pixel).norm_squared()))
        };
        let all = points.iter().zip(&self.sightings);
        let seen: f64 =
            all.map(|(point, sightings)| sightings.iter().map(|s| one(point, s)).sum::<f64>()).sum();
        let on_road = points.iter().zip(&self.on_road);
        let told = on_road.filter_map(|(point, o)| o.map(|o| o.cost(&poses[o.pose], point)));
        seen + told.sum::<f64>() + self.lengths.iter().map(|l| l.cost(poses)).sum::<f64>()
    }

    /// Solves in place.
    pub fn solve(&mut self, camera: &PinholeCamera, options: &BundleOptions) -> BundleReport {
        let kernel = Kernel::Cauchy(options.kernel_px);
        let slots: Vec<Option<usize>> = {
            let mut next = 0;
            self.fixed
                .iter()
                .map(|f| {
                    (!f).then(|| {
                        next += 1;
                        next - 1
                    })
                })
                .collect()
        };
        let free = slots.iter().flatten().count();
        let initial_cost = self.cost(camera, kernel, &self.poses, &self.points);
        let mut report = BundleReport { iterations: 0, initial_cost, final_cost: initial_cost };
        let mut lambda = 1e-4;
        while report.iterations < options.max_iterations {
            report.iterations += 1;
            let Some((pose_steps, point_steps)) = self.step(camera, kernel, &slots, free, lambda) else {
                lambda *= 10.0;
                continue;
            };
            let (poses, points) = self.moved(&slots, &pose_steps, &point_steps);
            let cost = self.cost(camera, kernel, &poses, &points);
            if cost < report.final_cost {
                let settled = report.final_cost - cost < options.relative_decrease * report.final_cost;
                (self.poses, self.points) = (poses, points);
                report.final_cost = cost;
                lambda = (lambda * 0.2).max(1e-9);
                if settled {
                    break;
                }
            } else {
                lambda *= 10.0;
                if lambda > 1e6 {
                    break;
                }
            }
        }
        report
    }

    fn moved(
        &self,
        slots: &[Option<usize>],
        pose_steps: &DVector<f64>,
        point_steps: &[Vector3<f64>],
    ) -> (Vec<CameraFromWorld>, Vec<Point3<f64>>) {
        let move_pose = |(pose, slot): (&Pose<Camera, World>, &Option<usize>)| match slot {
            Some(s) => pose.retract(&Vector6::from_iterator(pose_steps.rows(6 * s, 6).iter().copied())),
            None => *pose,
        };
        let poses = self.poses.iter().zip(slots).map(move_pose).collect();
        (poses, self.points.iter().zip(point_steps).map(|(p, d)| p + d).collect())
    }

    /// One damped Gauss–Newton step: reduced camera system by the Schur complement, then back-substitution.
    fn step(
        &self,
        camera: &PinholeCamera,
        kernel: Kernel,
        slots: &[Option<usize>],
        free: usize,
        lambda: f64,
    ) -> Option<(DVector<f64>, Vec<Vector3<f64>>)> {
        let mut diagonal = vec![Matrix6::<f64>::zeros(); free];
        let mut gradient = DVector::<f64>::zeros(6 * free);
        let mut blocks = Vec::with_capacity(self.points.len());
        for (index, (point, sightings)) in self.points.iter().zip(&self.sightings).enumerate() {
            let (mut hpp, mut gp) = (Matrix3::zeros(), Vector3::zeros());
            let mut cross = Vec::with_capacity(sightings.len());
            for s in sightings {
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
            if let Some(on_road) = self.on_road.get(index).copied().flatten() {
                let (r, w, j_pose, j_point) = on_road.linearise(&self.poses[on_road.pose], point);
                hpp += j_point * j_point.transpose() * w;
                gp += j_point * (r * w);
                if let Some(slot) = slots[on_road.pose] {
                    diagonal[slot] += j_pose * j_pose.transpose() * w;
                    let mut sum = gradient.fixed_rows_mut::<6>(6 * slot);
                    sum += j_pose * (r * w);
                    let by_both: Matrix6x3<f64> = j_pose * j_point.transpose() * w;
                    // The keyframe saw the point: its block is there already.
                    match cross.iter_mut().find(|(s, _)| *s == slot) {
                        Some((_, block)) => *block += by_both,
                        None => cross.push((slot, by_both)),
                    }
                }
            }
            for k in 0..3 {
                hpp[(k, k)] += lambda * hpp[(k, k)] + 1e-12;
            }
            // A point that nobody constrains stays where it is.
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
        self.add_lengths(slots, &mut reduced, &mut gradient);
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
        // Only the lower triangle is filled; Cholesky reads no other.
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
    fn add_lengths(&self, slots: &[Option<usize>], reduced: &mut DMatrix<f64>, gradient: &mut DVector<f64>) {
        for length in &self.lengths {
            let Some((residual, by_from, by_to)) = length.linearise(&self.poses) else { continue };
            let w = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX * LENGTH_KERNEL.weight(residual * residual);
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

/// `m -= a bᵀ` in the 6×6 block of two slots, written out: blocks this small lose more in calls than in arithmetic.
fn subtract_product(m: &mut DMatrix<f64>, [row, column]: [usize; 2], a: &Matrix6x3<f64>, b: &Matrix6x3<f64>) {
    let mut block = m.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    for c in 0..6 {
        let (b0, b1, b2) = (b[(c, 0)], b[(c, 1)], b[(c, 2)]);
        for r in 0..6 {
            block[(r, c)] -= a[(r, 0)] * b0 + a[(r, 1)] * b1 + a[(r, 2)] * b2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const CAMERA: PinholeCamera =
        PinholeCamera { fx: 720.0, fy: 720.0, cx: 600.0, cy: 180.0, width: 1242, height: 375 };

    #[test]
    fn lengths_match_differences_and_stretch_a_window() {
        let poses: Vec<CameraFromWorld> = vec![
            Pose::exp(&Vector6::new(0.1, -0.2, 0.05, 0.3, -0.1, 0.8)),
            Pose::exp(&Vector6::new(0.1, 0.3, -0.05, 0.5, 0.1, -0.9)),
        ];
        let length = Length { from: 0, to: 1, log_length: 0.3, sigma: 0.02 };
        let (r0, by_from, by_to) = length.linearise(&poses).unwrap();
        for (pose, jacobian) in [(0, by_from), (1, by_to)] {
            for k in 0..6 {
                let mut moved = poses.clone();
                let mut d = Vector6::zeros();
                d[k] = 1e-6;
                moved[pose] = moved[pose].retract(&d);
                let slope = (length.linearise(&moved).unwrap().0 - r0) / 1e-6;
                assert!((slope - jacobian[k]).abs() < 1e-3 * (1.0 + slope.abs()), "{pose} {k}");
            }
        }
        let mut problem = BundleProblem {
            poses: poses.clone(),
            fixed: vec![true, false],
            lengths: vec![length],
            ..Default::default()
        };
        problem.solve(&CAMERA, &BundleOptions { max_iterations: 30, ..Default::default() });
        let found = (problem.poses[1].inverse().translation() - poses[0].inverse().translation()).norm();
        assert!((found.ln() - 0.3).abs() < 1e-6, "{found}");
    }

    #[test]
    fn recovers_a_disturbed_window() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth: Vec<Pose<Camera, World>> = (0..8)
            .map(|k| Pose::exp(&Vector6::new(0.0, 0.01 * f64::from(k), 0.0, 0.0, 0.0, -1.1 * f64::from(k))))
            .collect();
        let mut problem = BundleProblem { poses: truth.clone(), fixed: vec![false; 8], ..Default::default() };
        problem.fixed[..2].fill(true);
        for _ in 0..200 {
            let p = Point3::new(
                rng.random_range(-10.0..10.0),
                rng.random_range(-4.0..1.6),
                rng.random_range(15.0..60.0),
            );
            let seen = truth.iter().enumerate().filter_map(|(k, t)| {
                Some(Sighting { pose: k, pixel: CAMERA.project(&t.transform_point(&p))? })
            });
            problem.sightings.push(seen.collect());
            problem.points.push(p + Vector3::new(0.0, 0.0, rng.random_range(-2.0..2.0)));
        }
        for pose in &mut problem.poses[2..] {
            let push = Vector6::from_fn(|_, _| rng.random_range(-0.01..0.01));
            *pose = pose.retract(&push);
        }
        let report = problem.solve(
            &CAMERA,
            &BundleOptions { max_iterations: 30, relative_decrease: 1e-12, ..Default::default() },
        );
        assert!(report.final_cost < 1e-6 * report.initial_cost, "{report:?}");
        for (found, pose) in problem.poses.iter().zip(&truth) {
            assert!((found.inverse() * *pose).log().norm() < 1e-4);
        }
    }
}
