//! Derivatives of box edges by the vehicle's position and size.

use motorcade_geometry::PinholeCamera;
use nalgebra::{Matrix3, Point3, RowVector3, RowVector6};

use crate::outline::ExtremePoint;

/// Derivative of an edge by (ahead, left, above | l, w, h) (1×6): that of its extreme point.
pub(super) fn edge_by_state(
    camera: &PinholeCamera,
    edge: usize,
    extreme: &ExtremePoint,
    axes: &Matrix3<f64>,
    rotation: &Matrix3<f64>,
) -> RowVector6<f64> {
    let by_point = edge_by_point(camera, edge, &extreme.point);
    let (by_position, by_body) = (by_point * axes, by_point * rotation);
    let f = &extreme.fractions;
    RowVector6::new(
        by_position.x,
        by_position.y,
        by_position.z,
        by_body.x * f.x,
        by_body.y * f.y,
        by_body.z * f.z,
    )
}

/// Derivative of an edge by its extreme point (1×3, camera frame) \[px/m\].
pub(super) fn edge_by_point(camera: &PinholeCamera, edge: usize, p: &Point3<f64>) -> RowVector3<f64> {
    if edge.is_multiple_of(2) {
        RowVector3::new(1.0, 0.0, -p.x / p.z) * (camera.fx / p.z)
    } else {
        RowVector3::new(0.0, 1.0, -p.y / p.z) * (camera.fy / p.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::{extreme_points, upright_axes};
    use motorcade_geometry::numeric::jacobian_error;
    use motorcade_perception::{BoxConvention, VehicleClass};
    use motorcade_testing::CAMERA;
    use nalgebra::{DMatrix, DVector, Vector3, Vector6};
    use std::convert::Infallible;

    #[test]
    fn derivatives_match_differences() {
        let outline = (VehicleClass::Car, BoxConvention::VisibleExtent);
        let ground = crate::box_fit::tests::ground();
        let rotation = upright_axes(&ground.direction_of(0.4), &ground.up);
        let x = Vector6::new(14.0, 3.0, 0.1, 4.2, 1.8, 1.5);
        let at = |x: &Vector6<f64>| {
            let position = ground.point(x[0], x[1], x[2]).coords;
            let size: Vector3<f64> = x.fixed_rows::<3>(3).into_owned();
            extreme_points(&CAMERA, &rotation, &position, outline, &size).unwrap()
        };
        let here = at(&x);
        let rows = here
            .iter()
            .enumerate()
            .map(|(edge, extreme)| edge_by_state(&CAMERA, edge, extreme, &ground.axes(), &rotation));
        let rows: Vec<RowVector6<f64>> = rows.collect();
        let error = jacobian_error(&DMatrix::from_fn(rows.len(), 6, |r, k| rows[r][k]), |step| {
            let edges = at(&(x + step.fixed_rows::<6>(0)));
            Ok::<_, Infallible>(DVector::from_iterator(edges.len(), edges.iter().map(|e| e.pixel)))
        });
        assert!(error.unwrap() < 1e-6);
    }
}
