//! Verification of a candidate: the query's camera from the landmarks of the earlier visit.

use motorcade_geometry::{
    AbsolutePoseOptions, Camera, PinholeCamera, Pose, Sighting, absolute_pose, projection_jacobian,
    robust::median,
};
use nalgebra::{Matrix2, Matrix2x3, Matrix6, Point2, Point3};

use crate::by_turn::ByTurn;
use crate::features::Feature;
use crate::keyframe::{Landmark, PlacedKeyframe};
use crate::options::{PlaceOptions, VerificationOptions};

/// Two visits of a place.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PlaceMatch {
    /// Index of the later keyframe.
    pub query: usize,
    /// Index of the earlier one.
    pub candidate: usize,
    /// The later camera from the earlier one, in metres of the earlier visit.
    pub query_from_candidate: Pose<Camera, Camera>,
    /// Covariance (6×6 `[ω, ν]`, right perturbation of that pose) by the pixels and the depths of the landmarks.
    pub covariance: Matrix6<f64>,
    /// Landmarks that agree.
    pub inliers: usize,
    /// Their share of the landmarks in view.
    pub share: f64,
    /// Root mean square reprojection error of the inliers \[px of their level\].
    pub rms_px: f64,
}

/// A landmark of the candidate and the feature of the query it is seen as.
#[derive(Clone, Copy)]
struct Pair<'a> {
    landmark: &'a Landmark,
    feature: &'a Feature,
}

/// Verifies a candidate; `None` where it is another place.
pub(crate) fn verify(
    camera: &PinholeCamera,
    (query, q): (usize, &PlacedKeyframe),
    (candidate, c): (usize, &PlacedKeyframe),
    options: &PlaceOptions,
) -> Option<PlaceMatch> {
    let verifier = Verifier {
        camera,
        level_scale: options.features.level_scale,
        options: &options.advanced.verification,
    };
    let first = verifier.look_alikes(q, c);
    let pose = verifier.pose(&first, options.advanced.verification.least_inliers.div_ceil(2))?.0;
    let (pairs, in_view) = verifier.guided(q, c, &pose);
    let (pose, inliers) = verifier.pose(&pairs, options.advanced.verification.least_inliers)?;
    let agreeing: Vec<Pair<'_>> = pairs.iter().zip(&inliers).filter(|(_, i)| **i).map(|(p, _)| *p).collect();
    let share = agreeing.len() as f64 / in_view.max(1) as f64;
    if share < options.advanced.verification.least_share || !verifier.plausible(&pose, &agreeing) {
        return None;
    }
    let rms_px = verifier.rms_px(&pose, &agreeing);
    let sigma_px = rms_px.max(options.advanced.landmarks.sigma_px);
    let covariance = verifier.covariance(&pose, &agreeing, sigma_px)?;
    let inliers = agreeing.len();
    Some(PlaceMatch { query, candidate, query_from_candidate: pose, covariance, inliers, share, rms_px })
}

struct Verifier<'a> {
    camera: &'a PinholeCamera,
    level_scale: f64,
    options: &'a VerificationOptions,
}

impl Verifier<'_> {
    /// Size of a pixel of the feature's level in the full image.
    fn scale(&self, feature: &Feature) -> f64 {
        self.level_scale.powi(i32::from(feature.level))
    }

    /// Largest difference of orientation in 256ths of a turn.
    fn most_turn(&self) -> u8 {
        (self.options.most_turn_rad / std::f64::consts::TAU * 256.0) as u8
    }

    fn may_match(&self, a: &Feature, b: &Feature) -> bool {
        a.level.abs_diff(b.level) <= self.options.most_levels && a.turn_to(b) <= self.most_turn()
    }

    /// Pairs that look alike and like nothing else, one a feature of the query.
    fn look_alikes<'a>(&self, q: &'a PlacedKeyframe, c: &'a PlacedKeyframe) -> Vec<Pair<'a>> {
        let by_turn = ByTurn::new(&q.features);
        let mut best: Vec<Option<(u32, &Landmark)>> = vec![None; q.features.len()];
        for landmark in &c.landmarks {
            let Some(own) = c.features.get(landmark.feature as usize) else { continue };
            let (mut first, mut second, mut at) = (u32::MAX, u32::MAX, usize::MAX);
            for (k, level, descriptor) in by_turn.around(own.turn, self.most_turn()) {
                if level.abs_diff(own.level) > self.options.most_levels {
                    continue;
                }
                let distance = own.descriptor.distance(&descriptor);
                // Of equally near ones the first, in whatever order they come.
                if (distance, k) < (first, at) {
                    (second, first, at) = (first, distance, k);
                } else if distance < second {
                    second = distance;
                }
            }
            let clear = f64::from(first) <= self.options.ratio * f64::from(second);
            if !clear || first > self.options.most_distance {
                continue;
            }
            if let Some(best) = best.get_mut(at).filter(|b| b.is_none_or(|(other, _)| first < other)) {
                *best = Some((first, landmark));
            }
        }
        let pair = |(feature, found): (&'a Feature, &Option<(u32, &'a Landmark)>)| {
            found.map(|(_, landmark)| Pair { landmark, feature })
        };
        q.features.iter().zip(&best).filter_map(pair).collect()
    }

    /// Pairs near where the pose projects the landmarks, and the number of landmarks in view.
    fn guided<'a>(
        &self,
        q: &'a PlacedKeyframe,
        c: &'a PlacedKeyframe,
        pose: &Pose<Camera, Camera>,
    ) -> (Vec<Pair<'a>>, usize) {
        let (mut pairs, mut in_view) = (Vec::new(), 0);
        for landmark in &c.landmarks {
            let Some(own) = c.features.get(landmark.feature as usize) else { continue };
            let seen = self.camera.project(&pose.transform_point(&landmark.point()));
            let in_picture = seen.filter(|p| self.camera.contains(p, self.options.margin_px));
            // Landmarks behind a vehicle are not in view.
            let Some(pixel) = in_picture.filter(|p| !q.hidden.hides(p)) else { continue };
            in_view += 1;
            let near = q.features.iter().filter(|f| {
                let reach = 2.0 * self.options.inlier_px * self.scale(f);
                (f.point() - pixel).norm() < reach && self.may_match(own, f)
            });
            let best = near.map(|f| (own.descriptor.distance(&f.descriptor), f)).min_by_key(|m| m.0);
            if let Some((_, feature)) = best.filter(|(d, _)| *d <= self.options.most_distance) {
                pairs.push(Pair { landmark, feature });
            }
        }
        (pairs, in_view)
    }

    fn pose(&self, pairs: &[Pair<'_>], least: usize) -> Option<(Pose<Camera, Camera>, Vec<bool>)> {
        if pairs.len() < least {
            return None;
        }
        let focal_px = self.camera.focal_px();
        let sighting = |p: &Pair<'_>| Sighting {
            point: p.landmark.point(),
            ray: self.camera.ray(&p.feature.point()),
            limit: self.options.inlier_px * self.scale(p.feature) / focal_px,
        };
        let sightings: Vec<Sighting> = pairs.iter().map(sighting).collect();
        let search = AbsolutePoseOptions {
            max_iterations: self.options.most_samples,
            seed: self.options.seed,
            ..AbsolutePoseOptions::default()
        };
        let found = absolute_pose(&sightings, &search)?;
        (found.inlier_count >= least).then_some((found.camera_from_points, found.inliers))
    }

    /// False for poses of another direction or too far away, and for evidence from one spot of the image.
    fn plausible(&self, pose: &Pose<Camera, Camera>, pairs: &[Pair<'_>]) -> bool {
        let mut depths: Vec<f64> = pairs.iter().map(|p| p.landmark.point().z).collect();
        let depth = median(&mut depths).unwrap_or(0.0);
        let columns: Vec<f64> = pairs.iter().map(|p| f64::from(p.feature.pixel[0])).collect();
        let mean = columns.iter().sum::<f64>() / columns.len().max(1) as f64;
        let variance = columns.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / columns.len().max(1) as f64;
        variance.sqrt() >= self.options.least_spread * f64::from(self.camera.width)
            && pose.rotation().angle() <= self.options.most_rotation_rad
            && pose.translation().norm() <= self.options.most_shift_depths * depth
    }

    /// Error in pixels of the feature's level.
    fn error_px(&self, pose: &Pose<Camera, Camera>, pair: &Pair<'_>) -> f64 {
        let seen: Option<Point2<f64>> = self.camera.project(&pose.transform_point(&pair.landmark.point()));
        seen.map_or(f64::INFINITY, |p| (p - pair.feature.point()).norm() / self.scale(pair.feature))
    }

    fn rms_px(&self, pose: &Pose<Camera, Camera>, pairs: &[Pair<'_>]) -> f64 {
        let squares: f64 = pairs.iter().map(|p| self.error_px(pose, p).powi(2)).sum();
        // Two coordinates a point.
        (0.5 * squares / pairs.len().max(1) as f64).sqrt()
    }

    /// (Σ Jᵀ W J)⁻¹, W from the noise of pixels and of the landmarks' depths.
    fn covariance(
        &self,
        pose: &Pose<Camera, Camera>,
        pairs: &[Pair<'_>],
        sigma_px: f64,
    ) -> Option<Matrix6<f64>> {
        let focal_px = self.camera.focal_px();
        let mut information = Matrix6::zeros();
        for pair in pairs {
            let point = pair.landmark.point();
            let seen: Point3<f64> = pose.transform_point(&point);
            let j = projection_jacobian(pose, &point, &seen);
            let by_point: Matrix2x3<f64> = j.fixed_view::<2, 3>(0, 3).into_owned();
            let pixel = sigma_px * self.scale(pair.feature) / focal_px;
            // An error of depth moves the point along its ray.
            let depth = by_point * point.coords * f64::from(pair.landmark.depth_sigma);
            let noise = Matrix2::identity() * (pixel * pixel) + depth * depth.transpose();
            information += j.transpose() * noise.try_inverse()? * j;
        }
        let covariance = information.cholesky()?.inverse();
        Some((covariance + covariance.transpose()) * 0.5)
    }
}
