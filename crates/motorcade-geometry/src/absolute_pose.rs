//! Pose of a camera from points with known positions: three-point samples, truncated quadratic scoring, refinement.

use nalgebra::{Matrix2x6, Matrix6, Point3, Vector2, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::lie::so3::hat;
use crate::p3p::p3p;
use crate::pose::{Frame, Pose};

/// Options of the search for a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsolutePoseOptions {
    /// Samples at most.
    pub max_iterations: usize,
    /// Probability of having drawn one all-inlier sample at which the search ends.
    pub confidence: f64,
    /// Iterations of the refinement.
    pub refinements: usize,
    /// Seed of the sampling.
    pub seed: u64,
}

impl Default for AbsolutePoseOptions {
    fn default() -> Self {
        Self { max_iterations: 300, confidence: 0.999, refinements: 8, seed: 1 }
    }
}

/// A point with known position, seen along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Position of the point.
    pub point: Point3<f64>,
    /// Ray it is seen along, z = 1.
    pub ray: Vector3<f64>,
    /// Reprojection error beyond which it is an outlier, in normalised units (pixels / focal length).
    pub limit: f64,
}

/// A pose and its evidence.
#[derive(Clone, Debug)]
pub struct AbsolutePose<C: Frame, P: Frame> {
    /// Maps points into the camera.
    pub camera_from_points: Pose<C, P>,
    /// Sightings that agree with it.
    pub inliers: Vec<bool>,
    /// Their number.
    pub inlier_count: usize,
}

/// Finds the pose that most sightings agree with. `None` with fewer than four, or where no sample is supported by a fourth.
pub fn absolute_pose<C: Frame, P: Frame>(
    sightings: &[Sighting],
    options: &AbsolutePoseOptions,
) -> Option<AbsolutePose<C, P>> {
    const LEAST: usize = 4;
    let n = sightings.len();
    if n < LEAST {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut best: Option<(f64, Pose<C, P>)> = None;
    let (mut iteration, mut needed) = (0, options.max_iterations);
    while iteration < needed.min(options.max_iterations) {
        iteration += 1;
        let sample = draw_three(&mut rng, n).map(|i| &sightings[i]);
        for pose in p3p(&sample.map(|s| s.point), &sample.map(|s| s.ray)) {
            let least = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            if let Some(loss) = loss_below(&pose, sightings, least) {
                let pose = refine(pose, sightings, 2);
                let ratio = inliers(&pose, sightings).1 as f64 / n as f64;
                let miss = (1.0 - ratio.powi(3)).clamp(1e-12, 1.0 - 1e-12);
                needed = ((1.0 - options.confidence).ln() / miss.ln()).ceil() as usize;
                best = Some((loss.min(self::loss(&pose, sightings)), pose));
            }
        }
    }
    let camera_from_points = refine(best?.1, sightings, options.refinements);
    let (inliers, inlier_count) = inliers(&camera_from_points, sightings);
    (inlier_count >= LEAST).then_some(AbsolutePose { camera_from_points, inliers, inlier_count })
}

fn draw_three(rng: &mut ChaCha8Rng, n: usize) -> [usize; 3] {
    let mut out = [rng.random_range(0..n), 0, 0];
    for k in 1..3 {
        out[k] = loop {
            let i = rng.random_range(0..n);
            if !out[..k].contains(&i) {
                break i;
            }
        };
    }
    out
}

/// Reprojection error in normalised units; `None` behind the camera.
fn error<C: Frame, P: Frame>(pose: &Pose<C, P>, sighting: &Sighting) -> Option<Vector2<f64>> {
    let p = pose.transform_point(&sighting.point);
    (p.z > 1e-6).then(|| Vector2::new(p.x / p.z - sighting.ray.x, p.y / p.z - sighting.ray.y))
}

/// Squared error over the squared limit, at most 1.
fn loss_of<C: Frame, P: Frame>(pose: &Pose<C, P>, sighting: &Sighting) -> f64 {
    error(pose, sighting).map_or(1.0, |e| (e.norm_squared() / (sighting.limit * sighting.limit)).min(1.0))
}

/// The losses of all sightings, summed.
fn loss<C: Frame, P: Frame>(pose: &Pose<C, P>, sightings: &[Sighting]) -> f64 {
    sightings.iter().map(|s| loss_of(pose, s)).sum()
}

/// Sightings that a sample is tried on first.
const TRIED_FIRST: usize = 20;
/// Sightings among those that must agree. A pose that three tenths of all agree with passes with 96 %, one by chance with 2 % (Chum &
/// Matas, BMVC 2002, the T(d, d) test).
const AGREEING_FIRST: usize = 3;

/// The summed loss where it is less than `least`. Most samples are wrong, and a few sightings show it.
fn loss_below<C: Frame, P: Frame>(pose: &Pose<C, P>, sightings: &[Sighting], least: f64) -> Option<f64> {
    let n = sightings.len();
    if n > 2 * TRIED_FIRST {
        let tried = (0..TRIED_FIRST).filter(|k| loss_of(pose, &sightings[k * n / TRIED_FIRST]) < 1.0);
        if tried.take(AGREEING_FIRST).count() < AGREEING_FIRST {
            return None;
        }
    }
    let mut sum = 0.0;
    for sighting in sightings {
        sum += loss_of(pose, sighting);
        if sum >= least {
            return None;
        }
    }
    Some(sum)
}

fn inliers<C: Frame, P: Frame>(pose: &Pose<C, P>, sightings: &[Sighting]) -> (Vec<bool>, usize) {
    let agrees = |s: &Sighting| error(pose, s).is_some_and(|e| e.norm_squared() < s.limit * s.limit);
    let flags: Vec<bool> = sightings.iter().map(agrees).collect();
    let count = flags.iter().filter(|f| **f).count();
    (flags, count)
}

/// Derivative (2×6) of a point's projection (z = 1) by a right perturbation `[ω, ν]` of `camera_from_points`; `point_in_camera` is R x + t.
pub fn projection_jacobian<C: Frame, P: Frame>(
    pose: &Pose<C, P>,
    point: &Point3<f64>,
    point_in_camera: &Point3<f64>,
) -> Matrix2x6<f64> {
    let iz = 1.0 / point_in_camera.z;
    let (x, y) = (point_in_camera.x * iz, point_in_camera.y * iz);
    let projection = nalgebra::Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
    // T exp(δ) x = R (x + ω × x + ν) + t
    let rotation = pose.rotation_matrix();
    let by_rotation = projection * rotation * -hat(&point.coords);
    let by_translation = projection * rotation;
    let mut out = Matrix2x6::zeros();
    out.fixed_view_mut::<2, 3>(0, 0).copy_from(&by_rotation);
    out.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_translation);
    out
}

/// Gauss–Newton under Tukey's biweight with its zero at the limit.
fn refine<C: Frame, P: Frame>(mut pose: Pose<C, P>, sightings: &[Sighting], iterations: usize) -> Pose<C, P> {
    for _ in 0..iterations {
        let (mut h, mut g) = (Matrix6::zeros(), Vector6::zeros());
        for s in sightings {
            let Some(e) = error(&pose, s) else { continue };
            let share = e.norm_squared() / (s.limit * s.limit);
            if share >= 1.0 {
                continue;
            }
            let weight = (1.0 - share).powi(2) / (s.limit * s.limit);
            let j = projection_jacobian(&pose, &s.point, &pose.transform_point(&s.point));
            h += j.transpose() * j * weight;
            g += j.transpose() * e * weight;
        }
        let Some(step) = h.cholesky().map(|c| -c.solve(&g)) else { break };
        if !step.iter().all(|v| v.is_finite()) {
            break;
        }
        pose = pose.retract(&step);
        if step.norm() < 1e-9 {
            break;
        }
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::jacobian_error;
    use crate::pose::{Camera, World};
    use nalgebra::{DMatrix, DVector};

    fn scene(outliers: usize, noise: f64) -> (Pose<Camera, World>, Vec<Sighting>) {
        let truth = Pose::exp(&Vector6::new(0.02, 0.1, -0.01, 0.6, -0.05, 1.2));
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut sightings = Vec::new();
        for k in 0..80 {
            let point = Point3::new(
                rng.random_range(-12.0..12.0),
                rng.random_range(-4.0..1.7),
                rng.random_range(5.0..40.0),
            );
            let p = truth.transform_point(&point);
            let mut n = || rng.random_range(-1.0..1.0) * noise;
            let mut ray = Vector3::new(p.x / p.z + n(), p.y / p.z + n(), 1.0);
            if k < outliers {
                ray = Vector3::new(rng.random_range(-0.8..0.8), rng.random_range(-0.2..0.2), 1.0);
            }
            sightings.push(Sighting { point, ray, limit: 3.0 / 720.0 });
        }
        (truth, sightings)
    }

    #[test]
    fn three_quarters_of_outliers_are_survived() {
        let (truth, sightings) = scene(56, 1.0 / 720.0);
        let options = AbsolutePoseOptions { max_iterations: 1000, ..Default::default() };
        let found = absolute_pose::<Camera, World>(&sightings, &options).unwrap();
        let error = (found.camera_from_points.inverse() * truth).log();
        assert!(error.fixed_rows::<3>(0).norm() < 2e-3 && error.fixed_rows::<3>(3).norm() < 0.05, "{error}");
        assert!((23..=30).contains(&found.inlier_count), "{}", found.inlier_count);
        assert!(found.inliers[56..].iter().filter(|i| **i).count() >= 23);
    }

    #[test]
    fn the_same_seed_gives_the_same_bits() {
        let (_, sightings) = scene(40, 1.0 / 720.0);
        let find = || absolute_pose::<Camera, World>(&sightings, &AbsolutePoseOptions::default()).unwrap();
        assert!(find().camera_from_points == find().camera_from_points);
    }

    #[test]
    fn jacobians_are_those_of_differences() {
        let (truth, sightings) = scene(0, 0.0);
        let point = sightings[3].point;
        let analytic = projection_jacobian(&truth, &point, &truth.transform_point(&point));
        let analytic = DMatrix::from_column_slice(2, 6, analytic.as_slice());
        let off = jacobian_error(&analytic, |step| {
            let step = Vector6::from_column_slice(step.as_slice());
            let residual = error(&truth.retract(&step), &sightings[3]).ok_or("behind the camera")?;
            Ok::<_, &str>(DVector::from_column_slice(residual.as_slice()))
        });
        assert!(off.unwrap() < 1e-6);
    }

    #[test]
    fn three_points_are_too_few() {
        let (_, sightings) = scene(0, 0.0);
        assert!(absolute_pose::<Camera, World>(&sightings[..3], &AbsolutePoseOptions::default()).is_none());
    }
}
