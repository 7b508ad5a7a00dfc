//! Sim(3): rigid motions with a scale, used to compare trajectories known up to scale.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// The similarity `x ↦ scale · R x + t`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Similarity {
    /// Scale, positive.
    pub scale: f64,
    /// Rotation R.
    pub rotation: UnitQuaternion<f64>,
    /// Translation t \[m\].
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// Nothing moves.
    pub fn identity() -> Self {
        Self { scale: 1.0, rotation: UnitQuaternion::identity(), translation: Vector3::zeros() }
    }
    /// Maps a point.
    pub fn transform_point(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * point.coords * self.scale + self.translation)
    }
    /// Maps a pose: orientation turned, position moved and scaled.
    pub fn transform_pose(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let position = self.transform_point(&Point3::from(pose.translation.vector));
        Isometry3::from_parts(position.coords.into(), self.rotation * pose.rotation)
    }
    /// The similarity the other way.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { scale: 1.0 / self.scale, rotation, translation: -(rotation * self.translation) / self.scale }
    }
    /// `self` after `other`.
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            scale: self.scale * other.scale,
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation * self.scale + self.translation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_and_compose_agree() {
        let a = Similarity {
            scale: 2.5,
            rotation: UnitQuaternion::from_euler_angles(0.1, -0.7, 0.3),
            translation: Vector3::new(1.0, 2.0, -3.0),
        };
        let p = Point3::new(0.3, -4.0, 9.0);
        let back = a.inverse().transform_point(&a.transform_point(&p));
        assert!((back - p).norm() < 1e-12);
        let twice = a.compose(&a).transform_point(&p);
        assert!((twice - a.transform_point(&a.transform_point(&p))).norm() < 1e-12);
    }
}
