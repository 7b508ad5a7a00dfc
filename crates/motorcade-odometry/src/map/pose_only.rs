//! Camera pose from known points: robust Gauss–Newton on the reprojection error.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::Kernel};
use nalgebra::{Matrix2x3, Matrix2x6, Matrix6, Point2, Point3, SMatrix, Vector2, Vector6};

use crate::buffer::make_room;

/// One point and where it was seen.
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

/// Limits of the refinement.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PoseOnlyOptions {
    /// Iterations at most.
    pub max_iterations: usize,
    /// Cauchy scale of the reprojection error at the end \[px\].
    pub kernel_px: f64,
    /// Limit of an inlier \[px\].
    pub inlier_px: f64,
}

impl Default for PoseOnlyOptions {
    fn default() -> Self {
        Self { max_iterations: 15, kernel_px: 1.0, inlier_px: 2.5 }
    }
}

/// Reprojection residual \[px\], Jacobian by the pose (2×6, `[ω, ν]` right perturbation of `camera_from_world`) and by the
/// point in the world (2×3). `None` behind the camera.
pub(crate) fn reprojection(
    camera: &PinholeCamera,
    camera_from_world: &Pose<Camera, World>,
    point_in_world: &Point3<f64>,
    pixel: &Point2<f64>,
) -> Option<(Vector2<f64>, Matrix2x6<f64>, Matrix2x3<f64>)> {
    let p = camera_from_world.transform_point(point_in_world);
    let projected = camera.project(&p)?;
    let iz = 1.0 / p.z;
    // ∂π/∂p (2×3)
    let d = Matrix2x3::new(
        camera.fx * iz,
        0.0,
        -camera.fx * p.x * iz * iz,
        0.0,
        camera.fy * iz,
        -camera.fy * p.y * iz * iz,
    );
    // p = R exp(ω) X + t + R ν  ⇒  ∂p/∂X = R, ∂p/∂ω = −R X^, ∂p/∂ν = R
    let r = camera_from_world.rotation_matrix();
    let row = |k: usize| r.row(0) * d[(k, 0)] + r.row(1) * d[(k, 1)] + r.row(2) * d[(k, 2)];
    let (u, v) = (row(0), row(1));
    // A row b times X^ is (b × X)ᵀ.
    let x = point_in_world.coords.transpose();
    let (u_turn, v_turn) = (x.cross(&u), x.cross(&v));
    let by_pose = Matrix2x6::new(
        u_turn.x, u_turn.y, u_turn.z, u.x, u.y, u.z, v_turn.x, v_turn.y, v_turn.z, v.x, v.y, v.z,
    );
    Some((projected - pixel, by_pose, Matrix2x3::from_rows(&[u, v])))
}

/// `h += w aᵀ b`, written out: matrices this small lose more in calls than in arithmetic.
pub(crate) fn add_outer<const R: usize, const C: usize>(
    h: &mut SMatrix<f64, R, C>,
    a: &SMatrix<f64, 2, R>,
    b: &SMatrix<f64, 2, C>,
    w: f64,
) {
    for c in 0..C {
        let (b0, b1) = (w * b[(0, c)], w * b[(1, c)]);
        for r in 0..R {
            h[(r, c)] += a[(0, r)] * b0 + a[(1, r)] * b1;
        }
    }
}

/// Refines poses, with memory that serves every time.
#[derive(Default)]
pub struct PoseRefiner {
    /// Reprojection errors \[px\], squared in the end.
    errors: Vec<f64>,
    inliers: Vec<bool>,
}

impl PoseRefiner {
    /// Which observations were inliers of the last refined pose.
    pub fn inliers(&self) -> &[bool] {
        &self.inliers
    }

    /// Lets the next observations, `count` at most, take no memory.
    pub(crate) fn make_room(&mut self, count: usize) {
        make_room(&mut self.errors, count);
        make_room(&mut self.inliers, count);
    }

    /// Refines a predicted pose. `None` with fewer than 6 observations or when the normal equations are singular.
    pub fn refine(
        &mut self,
        camera: &PinholeCamera,
        predicted: &Pose<Camera, World>,
        observations: &[Observation],
        options: &PoseOnlyOptions,
    ) -> Option<PoseEstimate> {
        self.inliers.clear();
        if observations.len() < 6 {
            return None;
        }
        let mut pose = *predicted;
        let mut information = Matrix6::zeros();
        // The kernel starts wide: the prediction may be off by tens of pixels, and narrows as the pose settles.
        let mut scale = (16.0 * options.kernel_px).max(self.residual_scale(camera, &pose, observations));
        for _ in 0..options.max_iterations {
            let kernel = Kernel::Cauchy(scale);
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
            let settled = step.norm() < 1e-7;
            if settled && scale <= options.kernel_px {
                break;
            }
            scale = (scale * 0.4).max(options.kernel_px);
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
        motorcade_geometry::robust::median(&mut self.errors).unwrap_or(1.0)
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
    fn jacobians_match_differences() {
        let pose = Pose::exp(&Vector6::new(0.1, -0.2, 0.05, 0.3, -0.1, 0.8));
        let point = Point3::new(1.5, -0.4, 9.0);
        let pixel = Point2::new(600.0, 170.0);
        let (r0, by_pose, by_point) = reprojection(&CAMERA, &pose, &point, &pixel).unwrap();
        let h = 1e-6;
        for k in 0..6 {
            let mut d = Vector6::zeros();
            d[k] = h;
            let (r, _, _) = reprojection(&CAMERA, &pose.retract(&d), &point, &pixel).unwrap();
            assert!(
                ((r - r0) / h - by_pose.column(k)).norm() < 1e-2 * (1.0 + by_pose.column(k).norm()) * 0.1
            );
        }
        for k in 0..3 {
            let mut moved = point;
            moved[k] += h;
            let (r, _, _) = reprojection(&CAMERA, &pose, &moved, &pixel).unwrap();
            assert!(((r - r0) / h - by_point.column(k)).norm() < 1e-3 * (1.0 + by_point.column(k).norm()));
        }
    }

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
