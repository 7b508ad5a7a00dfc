//! Reprojection residual and its Jacobians.

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use nalgebra::{Matrix2x3, Matrix2x6, Point2, Point3, SMatrix, Vector2};

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

/// `h += w aᵀ b`, unrolled for small matrices.
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

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::numeric::jacobian_error;
    use motorcade_testing::CAMERA;
    use nalgebra::{DMatrix, DVector, Vector6};

    #[test]
    fn jacobians_match_differences() {
        let pose = Pose::exp(&Vector6::new(0.1, -0.2, 0.05, 0.3, -0.1, 0.8));
        let point = Point3::new(1.5, -0.4, 9.0);
        let pixel = Point2::new(600.0, 170.0);
        let (_, by_pose, by_point) = reprojection(&CAMERA, &pose, &point, &pixel).unwrap();
        let mut analytic = SMatrix::<f64, 2, 9>::zeros();
        analytic.fixed_columns_mut::<6>(0).copy_from(&by_pose);
        analytic.fixed_columns_mut::<3>(6).copy_from(&by_point);
        let error = jacobian_error(&DMatrix::from_iterator(2, 9, analytic.iter().copied()), |step| {
            let (turn, shift) = (step.fixed_rows::<6>(0).into_owned(), step.fixed_rows::<3>(6));
            let found = reprojection(&CAMERA, &pose.retract(&turn), &(point + shift), &pixel);
            found.map(|(r, ..)| DVector::from_column_slice(r.as_slice())).ok_or(())
        });
        assert!(error.unwrap() < 1e-6);
    }
}
