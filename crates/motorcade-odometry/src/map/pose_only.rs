//! Camera pose from known points: robust Gauss–Newton on the reprojection error.

use motorcade_geometry::{
    Camera, PinholeCamera, Pose, World,
    robust::{RobustKernel, median},
};
use nalgebra::{Matrix6, Point2, Point3, Vector6};

use super::options::PoseOnlyOptions;
use super::reprojection::{add_outer, reprojection};
use crate::buffer::make_room;

/// A known point and its image.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// The point.
    pub point_in_world: Point3<f64>,
    /// Its image \[px\].
    pub pixel: Point2<f64>,
}

/// A refined pose and its evidence.
#[derive(Clone, Copy, Debug)]
pub struct PoseEstimate {
    /// The pose.
    pub camera_from_world: Pose<Camera, World>,
    /// Observations with a reprojection error below the inlier limit.
    pub inlier_count: usize,
    /// Root mean square reprojection error of the inliers \[px\].
    pub inlier_rms_px: f64,
    /// Σ JᵀWJ at the optimum (6×6, `[ω, ν]`, per px²): the information for unit pixel noise.
    pub information: Matrix6<f64>,
}

/// Pose refinement with buffers that are reused.
#[derive(Default)]
pub struct PoseRefiner {
    /// Reprojection errors \[px\], squared in the end.
    errors: Vec<f64>,
    inliers: Vec<bool>,
}

impl PoseRefiner {
    /// True for the inliers of the last refined pose, one per observation.
    pub fn inliers(&self) -> &[bool] {
        &self.inliers
    }

    /// Reserves room for `count` observations.
    pub(crate) fn make_room(&mut self, count: usize) {
        make_room(&mut self.errors, count);
        make_room(&mut self.inliers, count);
    }

    /// Refines a predicted pose. `None` with too few observations or when the normal equations are singular.
    pub fn refine(
        &mut self,
        camera: &PinholeCamera,
        predicted: &Pose<Camera, World>,
        observations: &[Observation],
        options: &PoseOnlyOptions,
    ) -> Option<PoseEstimate> {
        self.inliers.clear();
        if observations.len() < options.least_observations {
            return None;
        }
        let mut pose = *predicted;
        let mut information = Matrix6::zeros();
        // The kernel starts wide, because the prediction may be off by tens of pixels, and narrows as the pose converges.
        let mut scale = (options.initial_kernel_ratio * options.kernel_px).max(self.residual_scale(
            camera,
            &pose,
            observations,
        ));
        for _ in 0..options.max_iterations {
            let kernel = RobustKernel::Cauchy(scale);
            let (mut h, mut g) = (Matrix6::zeros(), Vector6::zeros());
            for o in observations {
                if let Some((r, j, _)) = reprojection(camera, &pose, &o.point_in_world, &o.pixel) {
                    let w = kernel.weight(r.norm_squared());
                    add_outer(&mut h, &j, &j, w);
                    add_outer(&mut g, &j, &r, w);
                }
            }
            information = h;
            let step = h.cholesky()?.solve(&-g);
            pose = pose.retract(&step);
            let converged = step.norm() < options.converged_step;
            if converged && scale <= options.kernel_px {
                break;
            }
            scale = (scale * options.kernel_decay).max(options.kernel_px);
        }
        let limit = options.inlier_px * options.inlier_px;
        let error = |o: &Observation| {
            let projected = camera.project(&pose.transform_point(&o.point_in_world))?;
            Some((projected - o.pixel).norm_squared())
        };
        self.errors.clear();
        self.errors.extend(observations.iter().map(|o| error(o).unwrap_or(f64::MAX)));
        self.inliers.extend(self.errors.iter().map(|e| *e < limit));
        let inlier_count = self.inliers.iter().filter(|i| **i).count();
        let sum: f64 = self.errors.iter().filter(|e| **e < limit).sum();
        let inlier_rms_px = if inlier_count > 0 { (sum / inlier_count as f64).sqrt() } else { f64::MAX };
        pose.is_finite().then_some(PoseEstimate {
            camera_from_world: pose,
            inlier_count,
            inlier_rms_px,
            information,
        })
    }

    fn residual_scale(
        &mut self,
        camera: &PinholeCamera,
        pose: &Pose<Camera, World>,
        observations: &[Observation],
    ) -> f64 {
        let project = |o: &Observation| camera.project(&pose.transform_point(&o.point_in_world));
        self.errors.clear();
        self.errors.extend(observations.iter().filter_map(|o| project(o).map(|p| (p - o.pixel).norm())));
        median(&mut self.errors).unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;
    use nalgebra::Vector2;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn finds_the_pose_through_a_third_of_outliers() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let truth: Pose<Camera, World> = Pose::exp(&Vector6::new(0.01, -0.03, 0.0, 0.1, 0.0, -1.2));
        let mut observations = Vec::new();
        for i in 0..150 {
            let p = Point3::new(
                rng.random_range(-8.0..8.0),
                rng.random_range(-3.0..1.6),
                rng.random_range(8.0..50.0),
            );
            let clean = CAMERA.project(&truth.transform_point(&p)).unwrap();
            let push = if i % 3 == 0 { rng.random_range(-60.0..60.0) } else { 0.0 };
            observations
                .push(Observation { point_in_world: p, pixel: clean + Vector2::new(push, 0.3 * push) });
        }
        let (mut refiner, options) = (PoseRefiner::default(), PoseOnlyOptions::default());
        let found = refiner.refine(&CAMERA, &Pose::identity(), &observations, &options).unwrap();
        assert!((found.camera_from_world.inverse() * truth).log().norm() < 1e-3);
        assert!(found.inlier_count >= 100);
        assert_eq!(refiner.inliers().iter().filter(|i| **i).count(), found.inlier_count);
        assert_eq!(refiner.inliers().len(), observations.len());
        assert!(refiner.refine(&CAMERA, &truth, &observations[..3], &options).is_none());
        assert!(refiner.inliers().is_empty());
    }
}
