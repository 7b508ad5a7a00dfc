//! Pose of a camera from three points: Grunert's quartic (Haralick, Lee, Ottenberg & Nölle, IJCV 13(3), 1994, eqs. 4–9).

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::polynomial::quartic_sign_changes;
use crate::pose::{Frame, Pose};

/// Largest ratio of two of the distances that is looked for.
const MOST_RATIO: f64 = 1e3;

/// Poses `camera_from_points` at which three points are seen along three rays, at most four. Rays need not be unit vectors.
///
/// Points on a line, coinciding points and coinciding rays have no answer.
pub fn p3p<C: Frame, P: Frame>(points: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Vec<Pose<C, P>> {
    let j = rays.map(|ray| ray.normalize());
    // Sides opposite to the points, and the angles under which they are seen.
    let [a2, b2, c2] = [(1, 2), (0, 2), (0, 1)].map(|(p, q)| (points[p] - points[q]).norm_squared());
    let [cos_a, cos_b, cos_c] = [(1, 2), (0, 2), (0, 1)].map(|(p, q): (usize, usize)| j[p].dot(&j[q]));
    let coordinates = a2 + b2 + c2;
    if !(coordinates.is_finite() && a2.min(b2).min(c2) > 1e-18 * coordinates) {
        return Vec::new();
    }
    let Some(from_points) = axes(&points.map(|p| p.coords)) else { return Vec::new() };
    // Distances s₁, s₂ = u s₁, s₃ = v s₁; the quartic in v.
    let (difference, sum) = ((a2 - c2) / b2, (a2 + c2) / b2);
    let (a_b, c_b) = (a2 / b2, c2 / b2);
    let quartic = [
        (1.0 + difference).powi(2) - 4.0 * a_b * cos_c * cos_c,
        4.0 * (-difference * (1.0 + difference) * cos_b + 2.0 * a_b * cos_c * cos_c * cos_b
            - (1.0 - sum) * cos_a * cos_c),
        2.0 * (difference * difference - 1.0
            + 2.0 * difference * difference * cos_b * cos_b
            + 2.0 * (1.0 - c_b) * cos_a * cos_a
            - 4.0 * sum * cos_a * cos_b * cos_c
            + 2.0 * (1.0 - a_b) * cos_c * cos_c),
        4.0 * (difference * (1.0 - difference) * cos_b - (1.0 - sum) * cos_a * cos_c
            + 2.0 * c_b * cos_a * cos_a * cos_b),
        (difference - 1.0).powi(2) - 4.0 * c_b * cos_a * cos_a,
    ];
    let pose = |v: f64| {
        let denominator = 2.0 * (cos_c - v * cos_a);
        let u = ((difference - 1.0) * v * v - 2.0 * difference * cos_b * v + 1.0 + difference) / denominator;
        let s1 = (b2 / (1.0 + v * v - 2.0 * v * cos_b)).sqrt();
        let usable = u.is_finite() && u > 0.0 && s1.is_finite() && denominator.abs() > 1e-12;
        let seen = usable.then(|| [j[0] * s1, j[1] * (u * s1), j[2] * (v * s1)])?;
        let rotation = axes(&seen)? * from_points.transpose();
        let [centre_seen, centre] = [seen, points.map(|p| p.coords)].map(|p| (p[0] + p[1] + p[2]) / 3.0);
        let orthonormal = Rotation3::from_matrix_unchecked(rotation);
        let translation = centre_seen - rotation * centre;
        Some(Pose::from_parts(UnitQuaternion::from_rotation_matrix(&orthonormal), translation))
    };
    let (roots, count) = quartic_sign_changes(&quartic, MOST_RATIO);
    roots.into_iter().take(count).filter_map(pose).collect()
}

/// Orthonormal axes of a triangle: along its first side, across it, and normal to both; `None` of points on a line.
fn axes(triangle: &[Vector3<f64>; 3]) -> Option<Matrix3<f64>> {
    let (u, v) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
    let normal = u.cross(&v);
    if normal.norm_squared() <= 1e-18 * u.norm_squared() * v.norm_squared() {
        return None;
    }
    let (x, z) = (u.normalize(), normal.normalize());
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Camera, World};
    use nalgebra::Vector6;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn one_of_the_answers_is_the_pose() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut all, mut found) = (0, 0);
        for _ in 0..500 {
            let truth = Pose::<Camera, World>::exp(&Vector6::from_fn(|_, _| rng.random_range(-0.6..0.6)));
            let points: [Point3<f64>; 3] = std::array::from_fn(|_| {
                Point3::new(
                    rng.random_range(-6.0..6.0),
                    rng.random_range(-3.0..3.0),
                    rng.random_range(4.0..30.0),
                )
            });
            let (u, v) = (points[1] - points[0], points[2] - points[0]);
            if u.cross(&v).norm() < 0.1 * u.norm() * v.norm() {
                continue;
            }
            all += 1;
            let rays = points.map(|p| truth.transform_point(&p).coords);
            let answers = p3p::<Camera, World>(&points, &rays);
            assert!(answers.len() <= 4);
            for pose in &answers {
                for (point, ray) in points.iter().zip(&rays) {
                    let seen = pose.transform_point(point).coords;
                    assert!(seen.dot(ray) > 0.0 && seen.normalize().cross(&ray.normalize()).norm() < 1e-4);
                }
            }
            found += usize::from(answers.iter().any(|p| (p.inverse() * truth).log().norm() < 1e-3));
        }
        // Two roots that almost coincide change no sign and are not found, which no sample of many needs.
        assert!(all > 400 && 100 * found >= 98 * all, "{found} of {all}");
    }

    #[test]
    fn the_usual_triangle_is_found_to_the_last_digits() {
        let truth = Pose::<Camera, World>::from_parts(
            UnitQuaternion::from_euler_angles(0.1, -0.2, 0.05),
            Vector3::new(0.4, -0.1, 1.5),
        );
        let points = [Point3::new(-4.0, 1.0, 12.0), Point3::new(5.0, 0.5, 20.0), Point3::new(1.0, -2.0, 9.0)];
        let rays = points.map(|p| truth.transform_point(&p).coords);
        let found = p3p::<Camera, World>(&points, &rays);
        let near = found.iter().map(|p| (p.inverse() * truth).log().norm()).fold(f64::INFINITY, f64::min);
        assert!(near < 1e-9, "{near}");
    }

    #[test]
    fn points_without_extent_have_no_answer() {
        let point = Point3::new(1.0, 2.0, 3.0);
        assert!(p3p::<Camera, World>(&[point; 3], &[Vector3::z(); 3]).is_empty());
    }
}
