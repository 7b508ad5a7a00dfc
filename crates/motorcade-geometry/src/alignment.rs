//! Best rotation, translation and scale between two point lists (Umeyama, PAMI 13(4), 1991).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::lie::sim3::Similarity;

/// The similarity that brings `source` closest to `target`, point by point, in the least-squares sense.
///
/// Without `with_scale` the scale is 1 (SE(3) alignment). `None` when the lists differ in length or are empty, when a
/// number is not finite, and, with scale, when all source points coincide. Points on one line leave the rotation about
/// that line open; any of the best ones comes out.
pub fn umeyama(source: &[Vector3<f64>], target: &[Vector3<f64>], with_scale: bool) -> Option<Similarity> {
    if source.is_empty() || source.len() != target.len() {
        return None;
    }
    let n = source.len() as f64;
    let mean_source = source.iter().sum::<Vector3<f64>>() / n;
    let mean_target = target.iter().sum::<Vector3<f64>>() / n;
    // Eq. 38: covariance of target against source (3×3); eq. 36: variance of the source.
    let mut covariance = Matrix3::zeros();
    let mut variance = 0.0;
    for (s, t) in source.iter().zip(target) {
        let centred = s - mean_source;
        covariance += (t - mean_target) * centred.transpose() / n;
        variance += centred.norm_squared() / n;
    }
    if !covariance.iter().all(|v| v.is_finite()) {
        return None;
    }
    let svd = covariance.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    // Eq. 39: a reflection is turned back along the least significant direction. Singular values come sorted.
    let sign = Vector3::new(1.0, 1.0, if (u * vt).determinant() < 0.0 { -1.0 } else { 1.0 });
    let rotation = u * Matrix3::from_diagonal(&sign) * vt;
    let scale = if with_scale { svd.singular_values.dot(&sign) / variance } else { 1.0 };
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let translation = mean_target - rotation * mean_source * scale;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Similarity { scale, rotation, translation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn points() -> Vec<Vector3<f64>> {
        (0..20).map(f64::from).map(|i| Vector3::new(i.sin() * 5.0, (0.7 * i).cos(), 0.9 * i)).collect()
    }

    proptest! {
        #[test]
        fn a_known_similarity_is_recovered(
            w in proptest::array::uniform3(-1.5..1.5_f64),
            t in proptest::array::uniform3(-50.0..50.0_f64),
            scale in 0.1..10.0_f64,
        ) {
            let truth = Similarity { scale, rotation: UnitQuaternion::new(w.into()), translation: t.into() };
            let moved: Vec<_> = points().iter().map(|p| truth.transform_point(&Point3::from(*p)).coords).collect();
            let found = umeyama(&points(), &moved, true).unwrap();
            prop_assert!((found.scale - scale).abs() < 1e-10 * scale);
            prop_assert!(found.rotation.angle_to(&truth.rotation) < 1e-7);
            prop_assert!((found.translation - truth.translation).norm() < 1e-8);
        }
    }

    #[test]
    fn mirrored_points_give_a_rotation_all_the_same() {
        let mirrored: Vec<_> = points().iter().map(|p| Vector3::new(-p.x, p.y, p.z)).collect();
        let found = umeyama(&points(), &mirrored, false).unwrap();
        assert!((found.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
        assert_eq!(found.scale, 1.0);
    }

    #[test]
    fn what_has_no_answer_has_none() {
        let still = vec![Vector3::new(1.0, 2.0, 3.0); 5];
        assert!(umeyama(&still, &still, true).is_none());
        assert!(umeyama(&still, &still, false).is_some());
        assert!(umeyama(&[], &[], false).is_none());
        assert!(umeyama(&points(), &still, false).is_none(), "lengths differ");
        let broken = vec![Vector3::new(f64::NAN, 0.0, 0.0); 5];
        assert!(umeyama(&broken, &still, false).is_none());
    }
}
