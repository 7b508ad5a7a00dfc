//! Relative pose of two calibrated views from ray matches: five-point samples, σ-consensus scoring, local
//! optimisation and nonlinear refinement of the Sampson error.
//!
//! The score of a model is the truncated quadratic loss averaged over noise levels up to σ_max (the idea of
//! MAGSAC, Barath et al. 2019, arXiv 1803.07469), so that no single inlier threshold has to be right.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::five_point::FivePoint;
use crate::lie::so3;
use crate::pose::{Frame, Pose};
use crate::robust::{RobustKernel, sigma_from_absolute};
use crate::triangulation::triangulate_midpoint;

/// Options of the search for the relative pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePoseOptions {
    /// Largest standard deviation of an inlier's reprojection noise, in normalised units (pixels / focal length).
    pub sigma_max: f64,
    /// Iterations at most.
    pub max_iterations: usize,
    /// Probability of having drawn one all-inlier sample at which the search ends.
    pub confidence: f64,
    /// Seed of the sampling.
    pub seed: u64,
}

impl RelativePoseOptions {
    /// Defaults for pixel noise up to `sigma_px` at focal length `focal_px`.
    pub fn for_pixel_noise(sigma_px: f64, focal_px: f64) -> Self {
        Self { sigma_max: sigma_px / focal_px, max_iterations: 500, confidence: 0.9999, seed: 1 }
    }
}

/// A relative pose and its evidence.
#[derive(Clone, Debug)]
pub struct RelativePose<B: Frame, A: Frame> {
    /// Rotation and unit translation, `b_from_a`.
    pub b_from_a: Pose<B, A>,
    /// Inliers by match (squared Sampson distance under (3 σ_max)², point in front of both).
    pub inliers: Vec<bool>,
    /// Number of inliers.
    pub inlier_count: usize,
    /// Samples drawn.
    pub iterations: usize,
}

/// Squared Sampson distance of a match `(ray_in_a, ray_in_b)` (z = 1) to an essential matrix, normalised units².
fn sampson_squared(e: &Matrix3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let (ea, eb) = (e * a, e.tr_mul(b));
    let r = b.dot(&ea);
    r * r / (ea.x * ea.x + ea.y * ea.y + eb.x * eb.x + eb.y * eb.y).max(1e-300)
}

/// Levels of noise the loss is averaged over, as fractions of σ_max.
const SIGMA_LEVELS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Truncation at 3 σ: the χ²₁ quantile at 99.7 %.
fn sigma_consensus_loss(squared: f64, sigma_max: f64) -> f64 {
    let loss = |level: &f64| (squared / (9.0 * level * level * sigma_max * sigma_max)).min(1.0);
    SIGMA_LEVELS.iter().map(loss).sum::<f64>() / SIGMA_LEVELS.len() as f64
}

/// Cut-offs of the local optimisation in σ_max: wide first, the model is still a sample's.
const LOCAL_CUTOFFS: [f64; 2] = [4.0, 3.0];
/// A sample this much worse than the best one is still refined.
const PROMISING: f64 = 1.2;
/// Draws at least: with noisy matches an all-inlier sample is not yet a good one.
const LEAST_ITERATIONS: usize = 200;

type Match = (Vector3<f64>, Vector3<f64>);

/// Estimates `b_from_a` up to scale from matches of rays with z = 1. `None` with fewer than 8 matches or when no model
/// is supported by half a dozen of them.
pub fn relative_pose<B: Frame, A: Frame>(
    matches: &[Match],
    options: &RelativePoseOptions,
) -> Option<RelativePose<B, A>> {
    const LEAST_MATCHES: usize = 8;
    if matches.len() < LEAST_MATCHES {
        return None;
    }
    let solver = FivePoint::default();
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut best: Option<(f64, Motion)> = None;
    // Samples of noisy matches are scored against the best sample, not against the far better refined model: several of
    // them get their chance of being refined, which is what leaves local minima behind.
    let mut best_sample = f64::MAX;
    let (mut iterations, mut needed) = (0, options.max_iterations);
    while iterations < needed.max(LEAST_ITERATIONS).min(options.max_iterations) {
        iterations += 1;
        let sample = draw_five(&mut rng, matches.len()).map(|i| matches[i]);
        let scored = solver.solve(&sample).into_iter().map(|e| (loss(&e, matches, options.sigma_max), e));
        let Some((sampled, e)) = scored.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if sampled > PROMISING * best_sample {
            continue;
        }
        best_sample = best_sample.min(sampled);
        let Some(mut motion) = decompose(&e, matches, options.sigma_max) else { continue };
        for cutoff in LOCAL_CUTOFFS {
            motion = refine(motion, matches, RobustKernel::Tukey(cutoff * options.sigma_max), 6);
        }
        let value = loss(&motion.essential(), matches, options.sigma_max);
        if best.as_ref().is_none_or(|b| value < b.0) {
            let ratio =
                inlier_count(&motion.essential(), matches, options.sigma_max) as f64 / matches.len() as f64;
            let miss = (1.0 - ratio.powi(5)).clamp(1e-12, 1.0 - 1e-12);
            needed = ((1.0 - options.confidence).ln() / miss.ln()).ceil() as usize;
            best = Some((value, motion));
        }
    }
    let motion = polish(best?.1, matches, options.sigma_max);
    let e = motion.essential();
    let b_from_a = Pose::from_parts(motion.rotation, motion.direction);
    let limit = 9.0 * options.sigma_max * options.sigma_max;
    let agrees = |(a, b): &Match| sampson_squared(&e, a, b) < limit;
    let inliers: Vec<bool> = matches.iter().map(agrees).collect();
    let inlier_count = inliers.iter().filter(|i| **i).count();
    (inlier_count > LEAST_MATCHES).then_some(RelativePose { b_from_a, inliers, inlier_count, iterations })
}

/// σ-consensus loss of a model, summed over all matches.
fn loss(e: &Matrix3<f64>, matches: &[Match], sigma_max: f64) -> f64 {
    matches.iter().map(|(a, b)| sigma_consensus_loss(sampson_squared(e, a, b), sigma_max)).sum()
}

fn inlier_count(e: &Matrix3<f64>, matches: &[Match], sigma_max: f64) -> usize {
    matches.iter().filter(|(a, b)| sampson_squared(e, a, b) < 9.0 * sigma_max * sigma_max).count()
}

fn draw_five(rng: &mut ChaCha8Rng, count: usize) -> [usize; 5] {
    let mut out = [usize::MAX; 5];
    for k in 0..5 {
        loop {
            let candidate = rng.random_range(0..count);
            if !out[..k].contains(&candidate) {
                out[k] = candidate;
                break;
            }
        }
    }
    out
}

#[derive(Clone, Copy, Debug)]
struct Motion {
    rotation: UnitQuaternion<f64>,
    direction: Vector3<f64>,
}

impl Motion {
    fn essential(&self) -> Matrix3<f64> {
        so3::hat(&self.direction) * self.rotation.to_rotation_matrix().into_inner()
    }
}

/// The decomposition of E with most points in front of both cameras.
fn decompose(e: &Matrix3<f64>, matches: &[Match], sigma_max: f64) -> Option<Motion> {
    let svd = e.svd(true, true);
    let (mut u, mut vt) = (svd.u?, svd.v_t?);
    if u.determinant() < 0.0 {
        u.column_mut(2).neg_mut();
    }
    if vt.determinant() < 0.0 {
        vt.row_mut(2).neg_mut();
    }
    let w = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let direction: Vector3<f64> = u.column(2).into_owned();
    let candidates = [
        (u * w * vt, direction),
        (u * w * vt, -direction),
        (u * w.transpose() * vt, direction),
        (u * w.transpose() * vt, -direction),
    ];
    let count = |motion: &Motion| {
        let pose = Pose::<(), ()>::from_parts(motion.rotation, motion.direction);
        let agreeing = matches.iter().filter(|(a, b)| sampson_squared(e, a, b) < 9.0 * sigma_max * sigma_max);
        agreeing.take(100).filter(|(a, b)| triangulate_midpoint(a, b, &pose).is_some()).count()
    };
    candidates
        .into_iter()
        .map(|(r, direction)| Motion { rotation: UnitQuaternion::from_matrix(&so3::nearest(&r)), direction })
        .map(|m| (count(&m), m))
        .max_by_key(|(n, _)| *n)
        .filter(|(n, _)| *n > 0)
        .map(|(_, m)| m)
}

/// Final refinement: the noise level is measured on the inliers, then Tukey's kernel at its 95 %-efficient cut-off.
fn polish(mut motion: Motion, matches: &[Match], sigma_max: f64) -> Motion {
    for _ in 0..3 {
        let e = motion.essential();
        let distances = matches.iter().map(|(a, b)| sampson_squared(&e, a, b).sqrt());
        let mut inside: Vec<f64> = distances.filter(|d| *d < 3.0 * sigma_max).collect();
        let sigma = sigma_from_absolute(&mut inside).unwrap_or(sigma_max).max(1e-3 * sigma_max);
        motion = refine(motion, matches, RobustKernel::Tukey(4.685 * sigma), 10);
    }
    motion
}

/// Gauss–Newton on the weighted Sampson error over rotation (3) and direction (2).
fn refine(mut motion: Motion, matches: &[Match], kernel: RobustKernel, iterations: usize) -> Motion {
    for _ in 0..iterations {
        let e = motion.essential();
        let rotation = motion.rotation.to_rotation_matrix().into_inner();
        let (p, q) = tangent_basis(&motion.direction);
        // dE/dparameter: right perturbation of R, tangent of the unit sphere for t (3×3 each).
        let derivatives: [Matrix3<f64>; 5] = [
            e * so3::hat(&Vector3::x()),
            e * so3::hat(&Vector3::y()),
            e * so3::hat(&Vector3::z()),
            so3::hat(&p) * rotation,
            so3::hat(&q) * rotation,
        ];
        let (mut h, mut g) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
        for (a, b) in matches {
            let (ea, eb) = (e * a, e.tr_mul(b));
            let norm2 = (ea.x * ea.x + ea.y * ea.y + eb.x * eb.x + eb.y * eb.y).max(1e-300);
            let r = b.dot(&ea);
            let weight = kernel.weight(r * r / norm2);
            if weight > 0.0 {
                // Full derivative of r/√norm2 (1×5): the denominator moves too.
                let j = SVector::<f64, 5>::from_fn(|k, _| {
                    let (da, db) = (derivatives[k] * a, derivatives[k].tr_mul(b));
                    let dnorm = ea.x * da.x + ea.y * da.y + eb.x * db.x + eb.y * db.y;
                    (b.dot(&da) - r * dnorm / norm2) / norm2.sqrt()
                });
                h += j * j.transpose() * weight;
                g += j * (weight * r / norm2.sqrt());
            }
        }
        let Some(step) = h.cholesky().map(|c| c.solve(&-g)) else { break };
        motion.rotation *= so3::exp(&step.fixed_rows::<3>(0).into_owned());
        motion.direction = (motion.direction + p * step[3] + q * step[4]).normalize();
        if step.norm() < 1e-10 {
            break;
        }
    }
    motion
}

fn tangent_basis(direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let seed = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let p = direction.cross(&seed).normalize();
    (p, direction.cross(&p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Camera, World};
    use crate::robust::median;

    /// The driving case of the field notes: 0.9 m forward, 400 matches, 0.4 px noise, 30 % outliers, f = 720 px.
    fn driving_matches(rng: &mut ChaCha8Rng) -> (Vec<Match>, UnitQuaternion<f64>, Vector3<f64>) {
        let focal = 720.0;
        let rotation = so3::exp(&Vector3::new(0.002, 0.01, -0.001));
        let translation = Vector3::new(0.02, -0.01, -0.9);
        let gauss = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let mut matches = Vec::new();
        while matches.len() < 400 {
            let z = rng.random_range(6.0..60.0);
            let ray = Vector3::new(rng.random_range(-0.85..0.85), rng.random_range(-0.25..0.28), 1.0);
            let moved = rotation * (ray * z) + translation;
            let mut noisy = |v: Vector3<f64>| {
                let n = Vector3::new(gauss(rng), gauss(rng), 0.0) * (0.4 / focal);
                v / v.z + n
            };
            let (a, b) = (noisy(ray), noisy(moved));
            let outlier = rng.random::<f64>() < 0.3;
            let wrong = Vector3::new(rng.random_range(-0.85..0.85), rng.random_range(-0.25..0.28), 1.0);
            matches.push((a, if outlier { wrong } else { b }));
        }
        (matches, rotation, translation.normalize())
    }

    #[test]
    fn driving_case_reaches_the_best_published_accuracy() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut rotations, mut directions) = (Vec::new(), Vec::new());
        for _ in 0..40 {
            let (matches, rotation, direction) = driving_matches(&mut rng);
            let options = RelativePoseOptions::for_pixel_noise(0.6, 720.0);
            let found = relative_pose::<Camera, World>(&matches, &options).unwrap();
            rotations.push(found.b_from_a.rotation().angle_to(&rotation).to_degrees());
            directions.push(found.b_from_a.translation().angle(&direction).to_degrees());
        }
        let (r, d) = (median(&mut rotations).unwrap(), median(&mut directions).unwrap());
        println!("median rotation error {r:.4} deg, direction {d:.3} deg");
        assert!(r <= 0.025, "rotation {r}");
        assert!(d <= 0.4, "direction {d}");
    }

    #[test]
    fn too_few_matches_are_refused() {
        let options = RelativePoseOptions::for_pixel_noise(1.0, 700.0);
        assert!(relative_pose::<Camera, World>(&[], &options).is_none());
    }
}
