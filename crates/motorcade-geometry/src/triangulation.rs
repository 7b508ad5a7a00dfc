//! Points from rays.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::pose::Pose;

/// The point nearest to two rays, in the frame of the first, with the cosine of the angle between them.
///
/// Rays need not be unit; `b_from_a` moves points from the first camera to the second. `None` for parallel rays or a
/// point behind either camera.
pub fn triangulate_midpoint<A, B>(
    ray_in_a: &Vector3<f64>,
    ray_in_b: &Vector3<f64>,
    b_from_a: &Pose<B, A>,
) -> Option<(Point3<f64>, f64)> {
    let a_from_b = b_from_a.inverse();
    let origin = a_from_b.translation();
    let (u, v) = (ray_in_a.normalize(), a_from_b.transform_vector(&ray_in_b.normalize()));
    let cosine = u.dot(&v);
    let denominator = 1.0 - cosine * cosine;
    if denominator < 1e-12 {
        return None;
    }
    let (along_u, along_v) = (u.dot(&origin), v.dot(&origin));
    let s = (along_u - cosine * along_v) / denominator;
    let t = (cosine * along_u - along_v) / denominator;
    (s > 0.0 && t > 0.0).then(|| (Point3::from((u * s + origin + v * t) * 0.5), cosine))
}

/// The point minimising the summed squared angular distance to several rays, in the world of the given
/// `(origin, unit direction)` rays. `None` when they are (nearly) parallel.
pub fn triangulate_rays(rays: &[(Point3<f64>, Vector3<f64>)]) -> Option<Point3<f64>> {
    let solve = |weight: &dyn Fn(&Point3<f64>) -> f64| -> Option<Point3<f64>> {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for (origin, direction) in rays {
            let projector = (Matrix3::identity() - direction * direction.transpose()) * weight(origin);
            a += projector;
            b += projector * origin.coords;
        }
        // Relative conditioning: a determinant near zero means the rays never separate.
        let trace = a.trace();
        (a.determinant() > 1e-12 * trace * trace * trace)
            .then(|| a.try_inverse())?
            .map(|i| Point3::from(i * b))
    };
    let first = solve(&|_| 1.0)?;
    // Second pass: distances become angles.
    solve(&|origin| 1.0 / (first - origin).norm_squared().max(1e-12))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Camera, World};
    use nalgebra::Vector6;

    #[test]
    fn exact_rays_meet() {
        let point = Point3::new(1.0, -0.5, 9.0);
        let b_from_a = Pose::<Camera, World>::exp(&Vector6::new(0.02, -0.05, 0.01, 0.1, 0.0, -1.0));
        let (found, cosine) =
            triangulate_midpoint(&point.coords, &b_from_a.transform_point(&point).coords, &b_from_a).unwrap();
        assert!((found - point).norm() < 1e-9 && cosine < 1.0);
        let origin_b = b_from_a.inverse().translation();
        let rays = [
            (Point3::origin(), point.coords.normalize()),
            (Point3::from(origin_b), (point.coords - origin_b).normalize()),
        ];
        assert!((triangulate_rays(&rays).unwrap() - point).norm() < 1e-6);
        assert!(triangulate_rays(&[rays[0], rays[0]]).is_none());
    }
}
