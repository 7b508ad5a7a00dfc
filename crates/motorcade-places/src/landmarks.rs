//! Positions of a keyframe's features by the views of neighbouring keyframes.

use motorcade_geometry::{Camera, PinholeCamera, Pose, triangulate_rays};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::features::Feature;
use crate::keyframe::Landmark;
use crate::options::{FeatureOptions, LandmarkOptions};

/// A neighbouring keyframe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbour<'a> {
    pub features: &'a [Feature],
    /// Its camera from that of the keyframe \[m\].
    pub neighbour_from_camera: Pose<Camera, Camera>,
}

/// A view of a feature in a neighbour.
#[derive(Clone, Copy)]
struct View {
    ray: Vector3<f64>,
    neighbour_from_camera: Pose<Camera, Camera>,
    /// Size of a pixel of its level in the full image.
    scale: f64,
}

/// Positions of the features that neighbours see too.
pub(crate) fn landmarks(
    camera: &PinholeCamera,
    features: &[Feature],
    neighbours: &[Neighbour<'_>],
    (options, extraction): (&LandmarkOptions, &FeatureOptions),
) -> Vec<Landmark> {
    let scale = |f: &Feature| extraction.level_scale.powi(i32::from(f.level));
    let mut views: Vec<Vec<View>> = vec![Vec::new(); features.len()];
    for neighbour in neighbours {
        let matches = epipolar_matches(camera, features, neighbour, &scale, options);
        for (views, found) in views.iter_mut().zip(matches) {
            views.extend(found);
        }
    }
    let landmark = |(k, (feature, views)): (usize, (&Feature, &Vec<View>))| {
        let own = View {
            ray: camera.ray(&feature.point()),
            neighbour_from_camera: Pose::identity(),
            scale: scale(feature),
        };
        let (point, depth_sigma) = triangulate(camera, &own, views, options)?;
        let point_in_camera = [point.x as f32, point.y as f32, point.z as f32];
        Some(Landmark { feature: k as u32, point_in_camera, depth_sigma: depth_sigma as f32 })
    };
    features.iter().zip(&views).enumerate().filter_map(landmark).collect()
}

/// For each feature its view in a neighbour: the one that looks most alike near the epipolar line, when it is clearly the best.
fn epipolar_matches(
    camera: &PinholeCamera,
    features: &[Feature],
    neighbour: &Neighbour<'_>,
    scale: &impl Fn(&Feature) -> f64,
    options: &LandmarkOptions,
) -> Vec<Option<View>> {
    let rays: Vec<Vector3<f64>> = neighbour.features.iter().map(|f| camera.ray(&f.point())).collect();
    let pose = neighbour.neighbour_from_camera;
    let t = pose.translation();
    let cross = Matrix3::new(0.0, -t.z, t.y, t.z, 0.0, -t.x, -t.y, t.x, 0.0);
    let essential = cross * pose.rotation_matrix();
    let best = |feature: &Feature| {
        let line = essential * camera.ray(&feature.point());
        // Distance in pixels for focal lengths that are about equal.
        let per_px = camera.focal_px() / line.xy().norm().max(1e-12);
        let (mut first, mut second, mut at) = (u32::MAX, u32::MAX, None);
        for (other, ray) in neighbour.features.iter().zip(&rays) {
            if line.dot(ray).abs() * per_px > options.most_error_px * scale(other)
                || other.level.abs_diff(feature.level) > 1
            {
                continue;
            }
            let distance = feature.descriptor.distance(&other.descriptor);
            if distance < first {
                (second, first, at) = (first, distance, Some((other, ray)));
            } else if distance < second {
                second = distance;
            }
        }
        let (other, ray) = at.filter(|_| {
            first <= options.most_distance && f64::from(first) <= options.ratio * f64::from(second)
        })?;
        Some(View { ray: *ray, neighbour_from_camera: pose, scale: scale(other) })
    };
    features.iter().map(best).collect()
}

/// Position and relative standard deviation of depth; `None` where the views disagree or determine no depth.
fn triangulate(
    camera: &PinholeCamera,
    own: &View,
    views: &[View],
    options: &LandmarkOptions,
) -> Option<(Point3<f64>, f64)> {
    let mut used: Vec<View> = Vec::with_capacity(1 + views.len());
    used.push(*own);
    used.extend_from_slice(views);
    // A wrong view is dropped once.
    for _ in 0..2 {
        if used.len() < 2 {
            return None;
        }
        let point = intersect(&used)?;
        let error_px = |v: &View| {
            let p = v.neighbour_from_camera.transform_point(&point);
            let error =
                Vector3::new(p.x / p.z - v.ray.x, p.y / p.z - v.ray.y, 0.0).norm() * camera.focal_px();
            if p.z > 0.1 { error / v.scale } else { f64::INFINITY }
        };
        let errors: Vec<f64> = used.iter().map(error_px).collect();
        if errors.iter().all(|e| *e <= options.most_error_px) {
            let sigma = depth_sigma(camera, &used, &point, options);
            return (sigma <= options.most_depth_sigma).then_some((point, sigma));
        }
        let worst = (1..used.len()).max_by(|a, b| errors[*a].total_cmp(&errors[*b]))?;
        used.remove(worst);
    }
    None
}

fn intersect(views: &[View]) -> Option<Point3<f64>> {
    let rays: Vec<(Point3<f64>, Vector3<f64>)> = views
        .iter()
        .map(|v| {
            let camera_from_neighbour = v.neighbour_from_camera.inverse();
            let direction = camera_from_neighbour.transform_vector(&v.ray).normalize();
            (Point3::from(camera_from_neighbour.translation()), direction)
        })
        .collect();
    triangulate_rays(&rays).filter(|p| p.z > 0.1)
}

/// Standard deviation of the depth over the depth, from the angles between the rays.
fn depth_sigma(
    camera: &PinholeCamera,
    views: &[View],
    point: &Point3<f64>,
    options: &LandmarkOptions,
) -> f64 {
    let mut information = Matrix3::zeros();
    for v in views {
        let camera_from_neighbour = v.neighbour_from_camera.inverse();
        let ray = point - Point3::from(camera_from_neighbour.translation());
        let distance = ray.norm().max(1e-6);
        let direction = ray / distance;
        let sigma = options.sigma_px * v.scale / camera.focal_px() * distance;
        information += (Matrix3::identity() - direction * direction.transpose()) / (sigma * sigma);
    }
    let along = point.coords.normalize();
    let variance = information.try_inverse().map_or(f64::INFINITY, |c| along.dot(&(c * along)));
    variance.max(0.0).sqrt() / point.coords.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::Descriptor;
    use motorcade_testing::CAMERA;
    use nalgebra::Vector6;
    use rand::{Rng, SeedableRng};

    /// A keyframe's pose and its features.
    type Seen = (Pose<Camera, Camera>, Vec<Feature>);

    /// Points seen from keyframes 2 m apart; each has a random descriptor.
    fn views(count: usize) -> (Vec<Point3<f64>>, Vec<Seen>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(9);
        let points: Vec<Point3<f64>> = (0..count)
            .map(|_| {
                let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                let x = side * rng.random_range(4.0..9.0);
                Point3::new(x, rng.random_range(-3.0..1.6), rng.random_range(9.0..35.0))
            })
            .collect();
        let looks: Vec<Descriptor> =
            (0..count).map(|_| Descriptor(std::array::from_fn(|_| rng.random()))).collect();
        let pose = |k: f64| Pose::exp(&Vector6::new(0.0, 0.01 * k, 0.0, 0.0, 0.0, -2.0 * k));
        let mut seen = |pose: &Pose<Camera, Camera>| -> Vec<Feature> {
            let feature = |(p, descriptor): (&Point3<f64>, &Descriptor)| {
                let pixel = CAMERA.project(&pose.transform_point(p))?;
                let mut noise = || rng.random_range(-0.6..0.6);
                let pixel = [(pixel.x + noise()) as f32, (pixel.y + noise()) as f32];
                Some(Feature { descriptor: *descriptor, pixel, level: 0, turn: 0 })
            };
            points.iter().zip(&looks).filter_map(feature).collect()
        };
        let all = [-1.0, 0.0, 1.0].map(pose).into_iter().map(|p| (p, seen(&p))).collect();
        (points, all)
    }

    #[test]
    fn positions_are_right_within_their_deviations() {
        let (points, all) = views(120);
        let neighbour = |k: usize| Neighbour { features: &all[k].1, neighbour_from_camera: all[k].0 };
        let options = (&LandmarkOptions::default(), &FeatureOptions::default());
        let found = landmarks(&CAMERA, &all[1].1, &[neighbour(0), neighbour(2)], options);
        assert!(found.len() > 90, "{}", found.len());
        let mut squares = 0.0;
        for landmark in &found {
            let truth = points[landmark.feature as usize];
            let error = (landmark.point().coords.norm() - truth.coords.norm()) / truth.coords.norm();
            squares += (error / f64::from(landmark.depth_sigma)).powi(2);
        }
        let mean = squares / found.len() as f64;
        assert!((0.1..1.5).contains(&mean), "mean squared normalised error {mean}");
    }

    #[test]
    fn features_that_move_have_no_position() {
        let (_, mut all) = views(120);
        for feature in &mut all[2].1 {
            feature.pixel[1] += 9.0;
        }
        let neighbour = |k: usize| Neighbour { features: &all[k].1, neighbour_from_camera: all[k].0 };
        let options = (&LandmarkOptions::default(), &FeatureOptions::default());
        assert!(landmarks(&CAMERA, &all[1].1, &[neighbour(2)], options).len() < 12);
    }
}
