//! Windowed bundle adjustment: keyframe poses and points, Schur complement on the points, Levenberg–Marquardt.
//!
//! Minimises `Σ ρ(‖π(T_k X_i) − x_ki‖²)` over the free poses `T_k = camera_from_world` (right perturbation `[ω, ν]`) and
//! points `X_i`. Fixed poses hold the gauge: seven degrees of freedom, so at least two poses must be fixed.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::{DVector, Point3, Vector3, Vector6};

use super::bundle_problem::BundleProblem;
use super::options::BundleOptions;

type CameraFromWorld = Pose<Camera, World>;

/// Report of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BundleReport {
    /// Iterations taken.
    pub iterations: usize,
    /// Robust cost before \[px²\].
    pub initial_cost: f64,
    /// Robust cost after \[px²\].
    pub final_cost: f64,
}

impl BundleProblem {
    /// Solves in place.
    pub fn solve(&mut self, camera: &PinholeCamera, options: &BundleOptions) -> BundleReport {
        let damping = options;
        let mut free = 0;
        let mut slot = |fixed: &bool| {
            (!fixed).then(|| {
                free += 1;
                free - 1
            })
        };
        let slots: Vec<Option<usize>> = self.fixed.iter().map(&mut slot).collect();
        let initial_cost = self.cost(camera, options, &self.poses, &self.points);
        let mut report = BundleReport { iterations: 0, initial_cost, final_cost: initial_cost };
        let mut lambda = damping.initial_damping;
        while report.iterations < options.max_iterations {
            report.iterations += 1;
            let Some((pose_steps, point_steps)) = self.step(camera, options, &slots, free, lambda) else {
                lambda *= damping.damping_increase;
                continue;
            };
            let (poses, points) = self.moved(&slots, &pose_steps, &point_steps);
            let cost = self.cost(camera, options, &poses, &points);
            if cost < report.final_cost {
                let converged = report.final_cost - cost < options.relative_decrease * report.final_cost;
                (self.poses, self.points) = (poses, points);
                report.final_cost = cost;
                lambda = (lambda * damping.damping_decrease).max(damping.least_damping);
                if converged {
                    break;
                }
            } else {
                lambda *= damping.damping_increase;
                if lambda > damping.most_damping {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::baseline_length::BaselineLength;
    use crate::map::bundle_problem::KeyframeObservation;
    use motorcade_testing::CAMERA;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_length_stretches_a_window() {
        let poses: Vec<CameraFromWorld> = vec![
            Pose::exp(&Vector6::new(0.1, -0.2, 0.05, 0.3, -0.1, 0.8)),
            Pose::exp(&Vector6::new(0.1, 0.3, -0.05, 0.5, 0.1, -0.9)),
        ];
        let length = BaselineLength { from: 0, to: 1, log_length: 0.3, sigma: 0.02 };
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
    fn recovers_a_perturbed_window() {
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
            let observed = truth.iter().enumerate().filter_map(|(k, t)| {
                Some(KeyframeObservation { pose: k, pixel: CAMERA.project(&t.transform_point(&p))? })
            });
            problem.observations.push(observed.collect());
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
