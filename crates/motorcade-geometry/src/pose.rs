//! Rigid transforms whose frames are part of their type.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::lie::se3;

/// A coordinate frame, used only as a type.
pub trait Frame: Copy + fmt::Debug + Send + Sync + 'static {
    /// Name in messages.
    const NAME: &'static str;
}

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident = $text:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name;
        impl Frame for $name { const NAME: &'static str = $text; }
    )*};
}

frames! {
    /// The world: the camera frame of the first processed frame.
    World = "world";
    /// A camera: x right, y down, z forward.
    Camera = "camera";
    /// A vehicle: x forward, y left, z up, origin on the road below the body centre.
    Vehicle = "vehicle";
}

/// The rigid transform `to_from_from`: maps a point in `From` to the same point in `To`.
///
/// Tangent order `[ω, ν]`, right perturbation: `T · exp(δ)`.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(bound = "")]
pub struct Pose<To, From> {
    isometry: Isometry3<f64>,
    #[serde(skip)]
    frames: PhantomData<fn() -> (To, From)>,
}

impl<To, From> Clone for Pose<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Pose<To, From> {}
impl<To, From> PartialEq for Pose<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.isometry == other.isometry
    }
}
impl<To: Frame, From: Frame> fmt::Debug for Pose<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_from_{} {:?}", To::NAME, From::NAME, self.isometry)
    }
}
impl<To, From> Default for Pose<To, From> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<To, From> Pose<To, From> {
    /// Wraps an isometry.
    pub fn new(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }
    /// Both frames coincide.
    pub fn identity() -> Self {
        Self::new(Isometry3::identity())
    }
    /// From a rotation matrix (3×3, made orthonormal if it is slightly off) and a translation \[m\].
    pub fn from_matrix(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Self {
        // The SVD projection is exact for a near rotation and does not iterate without bound.
        let rotation = crate::lie::so3::nearest(rotation);
        let quaternion = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Self::new(Isometry3::from_parts(Translation3::from(*translation), quaternion))
    }
    /// From a rotation and a translation \[m\].
    pub fn from_parts(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Self {
        Self::new(Isometry3::from_parts(Translation3::from(translation), rotation))
    }
    /// `exp` of a tangent `[ω, ν]`.
    pub fn exp(tangent: &Vector6<f64>) -> Self {
        Self::new(se3::exp(tangent))
    }
    /// The tangent `[ω, ν]` whose `exp` is this pose.
    pub fn log(&self) -> Vector6<f64> {
        se3::log(&self.isometry)
    }
    /// Right perturbation: `T · exp(δ)`, re-normalised.
    #[must_use]
    pub fn retract(&self, tangent: &Vector6<f64>) -> Self {
        let mut isometry = self.isometry * se3::exp(tangent);
        isometry.rotation.renormalize();
        Self::new(isometry)
    }
    /// The transform the other way.
    pub fn inverse(&self) -> Pose<From, To> {
        Pose::new(self.isometry.inverse())
    }
    /// The plain isometry.
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }
    /// Rotation part.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }
    /// Rotation part as a 3×3 matrix.
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        self.isometry.rotation.to_rotation_matrix().into_inner()
    }
    /// Translation part: the origin of `From` in `To` \[m\].
    pub fn translation(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }
    /// The same rotation with the translation multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self::from_parts(self.rotation(), self.translation() * factor)
    }
    /// Maps a point.
    pub fn transform_point(&self, point_in_from: &Point3<f64>) -> Point3<f64> {
        self.isometry * point_in_from
    }
    /// Rotates a direction.
    pub fn transform_vector(&self, vector_in_from: &Vector3<f64>) -> Vector3<f64> {
        self.isometry.rotation * vector_in_from
    }
    /// Renames the frames; for borders where the meaning is known but the type is not.
    pub fn cast<NewTo, NewFrom>(self) -> Pose<NewTo, NewFrom> {
        Pose::new(self.isometry)
    }
    /// Interpolates between two poses, `fraction` 0 gives `self`, 1 gives `other` (rotation by slerp).
    #[must_use]
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        Self::new(self.isometry.lerp_slerp(&other.isometry, fraction))
    }
    /// True when every number is finite.
    pub fn is_finite(&self) -> bool {
        self.translation().iter().all(|v| v.is_finite())
            && self.rotation().coords.iter().all(|v| v.is_finite())
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;
    fn mul(self, rhs: Pose<B, C>) -> Pose<A, C> {
        let mut isometry = self.isometry * rhs.isometry;
        // Products of thousands of poses stay unit quaternions.
        isometry.rotation.renormalize_fast();
        Pose::new(isometry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tangent() -> impl Strategy<Value = Vector6<f64>> {
        proptest::array::uniform6(-2.0..2.0_f64).prop_map(|a| Vector6::from_row_slice(&a))
    }

    proptest! {
        #[test]
        fn inverse_cancels(a in tangent()) {
            let pose = Pose::<World, Camera>::exp(&a);
            prop_assert!((pose * pose.inverse()).log().norm() < 1e-12);
        }

        #[test]
        fn retract_moves_in_the_right_tangent(a in tangent(), d in tangent()) {
            let pose = Pose::<World, Camera>::exp(&a);
            let moved = pose.retract(&(d * 0.5));
            let back: Vector6<f64> = (pose.inverse() * moved).log();
            prop_assert!((back - d * 0.5).norm() < 1e-9);
        }
    }
}
