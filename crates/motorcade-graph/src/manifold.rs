//! The spaces variables live in.
//!
//! A [`Manifold`] moves along a tangent (`retract`) and gives the tangent between two elements (`local`), with
//! `x.retract(x.local(y)) = y`. Tangents are rotation first and act on the right:
//!
//! | space | tangent | `retract` |
//! |---|---|---|
//! | SE(3) [`Isometry3`] | `[ω, ν]` (6) | `X · exp([ω, ν])` |
//! | SE(2) [`Isometry2`] | `[θ, ν]` (3) | `(R · rot(θ), t + R ν)` |
//! | Sim(3) [`Similarity`] | `[ω, ν, λ]` (7) | `(R · exp(ω), t + s R ν, s · e^λ)` |
//! | R^n [`DVector`] | n | `x + δ` |

use motorcade_geometry::lie::sim3::Similarity;
use motorcade_geometry::lie::{se3, so3};
use nalgebra::{
    DMatrix, DVector, Isometry2, Isometry3, Translation2, UnitComplex, UnitQuaternion, Vector2, Vector3,
    Vector6,
};

/// A smooth space with a local chart.
pub trait Manifold: Sized {
    /// Dimension of the tangent.
    fn dof(&self) -> usize;
    /// The element reached along `delta` (`dof` numbers).
    #[must_use]
    fn retract(&self, delta: &[f64]) -> Self;
    /// The tangent that leads from `self` to `other`, written to `out` (`dof` numbers).
    fn local(&self, other: &Self, out: &mut [f64]);
    /// Derivative (dof × dof) of `self.local(other ⊞ δ)` by δ at 0.
    fn local_jacobian(&self, other: &Self) -> DMatrix<f64>;
}

/// Unit length again: products of unit quaternions drift by rounding.
fn tidy(mut q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    q.renormalize_fast();
    q
}

impl Manifold for Isometry3<f64> {
    fn dof(&self) -> usize {
        6
    }
    fn retract(&self, delta: &[f64]) -> Self {
        let moved = self * se3::exp(&Vector6::from_iterator(delta.iter().copied()));
        Self::from_parts(moved.translation, tidy(moved.rotation))
    }
    fn local(&self, other: &Self, out: &mut [f64]) {
        out.copy_from_slice(se3::log(&(self.inverse() * other)).as_slice());
    }
    fn local_jacobian(&self, other: &Self) -> DMatrix<f64> {
        let jacobian = se3::right_jacobian_inverse(&se3::log(&self.inv_mul(other)));
        DMatrix::from_column_slice(6, 6, jacobian.as_slice())
    }
}

impl Manifold for Isometry2<f64> {
    fn dof(&self) -> usize {
        3
    }
    fn retract(&self, delta: &[f64]) -> Self {
        let moved = self.translation.vector + self.rotation * Vector2::new(delta[1], delta[2]);
        let mut rotation = self.rotation * UnitComplex::new(delta[0]);
        rotation.renormalize_fast();
        Self::from_parts(Translation2::from(moved), rotation)
    }
    fn local(&self, other: &Self, out: &mut [f64]) {
        let d = self.inverse() * other;
        out.copy_from_slice(&[d.rotation.angle(), d.translation.x, d.translation.y]);
    }
    fn local_jacobian(&self, other: &Self) -> DMatrix<f64> {
        let mut out = DMatrix::identity(3, 3);
        let r = self.rotation.rotation_to(&other.rotation).to_rotation_matrix();
        out.view_mut((1, 1), (2, 2)).copy_from(r.matrix());
        out
    }
}

impl Manifold for Similarity {
    fn dof(&self) -> usize {
        7
    }
    fn retract(&self, delta: &[f64]) -> Self {
        let step = Self {
            rotation: so3::exp(&Vector3::new(delta[0], delta[1], delta[2])),
            translation: Vector3::new(delta[3], delta[4], delta[5]),
            scale: delta[6].exp(),
        };
        let moved = self.compose(&step);
        Self { rotation: tidy(moved.rotation), ..moved }
    }
    fn local(&self, other: &Self, out: &mut [f64]) {
        let d = self.inverse().compose(other);
        out[..3].copy_from_slice(so3::log(&d.rotation).as_slice());
        out[3..6].copy_from_slice(d.translation.as_slice());
        out[6] = d.scale.ln();
    }
    fn local_jacobian(&self, other: &Self) -> DMatrix<f64> {
        let d = self.inverse().compose(other);
        let mut out = DMatrix::identity(7, 7);
        out.view_mut((0, 0), (3, 3)).copy_from(&so3::right_jacobian_inverse(&so3::log(&d.rotation)));
        let r = d.rotation.to_rotation_matrix().into_inner() * d.scale;
        out.view_mut((3, 3), (3, 3)).copy_from(&r);
        out
    }
}

impl Manifold for DVector<f64> {
    fn dof(&self) -> usize {
        self.len()
    }
    fn retract(&self, delta: &[f64]) -> Self {
        Self::from_iterator(self.len(), self.iter().zip(delta).map(|(x, d)| x + d))
    }
    fn local(&self, other: &Self, out: &mut [f64]) {
        for (o, (x, y)) in out.iter_mut().zip(self.iter().zip(other.iter())) {
            *o = y - x;
        }
    }
    fn local_jacobian(&self, _other: &Self) -> DMatrix<f64> {
        DMatrix::identity(self.len(), self.len())
    }
}

/// A variable's value, of one of the spaces above.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Value {
    /// Rigid motion.
    Se3(Isometry3<f64>),
    /// Rigid motion of the plane.
    Se2(Isometry2<f64>),
    /// Similarity.
    Sim3(Similarity),
    /// Point of R^n.
    Vector(DVector<f64>),
}

/// A type that a [`Value`] can hold.
pub trait Variable: Manifold + Into<Value> {
    /// Name in errors.
    const NAME: &'static str;
    /// The value when it has this type.
    fn of(value: &Value) -> Option<&Self>;
}

macro_rules! variable {
    ($type:ty, $variant:ident, $name:literal) => {
        impl From<$type> for Value {
            fn from(value: $type) -> Self {
                Self::$variant(value)
            }
        }
        impl Variable for $type {
            const NAME: &'static str = $name;
            fn of(value: &Value) -> Option<&Self> {
                if let Value::$variant(x) = value { Some(x) } else { None }
            }
        }
    };
}
variable!(Isometry3<f64>, Se3, "SE(3) pose");
variable!(Isometry2<f64>, Se2, "SE(2) pose");
variable!(Similarity, Sim3, "Sim(3) similarity");
variable!(DVector<f64>, Vector, "vector");

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Vector(DVector::from_element(1, value))
    }
}

impl Manifold for Value {
    fn dof(&self) -> usize {
        match self {
            Self::Se3(x) => x.dof(),
            Self::Se2(x) => x.dof(),
            Self::Sim3(x) => x.dof(),
            Self::Vector(x) => x.dof(),
        }
    }
    fn retract(&self, delta: &[f64]) -> Self {
        match self {
            Self::Se3(x) => Self::Se3(x.retract(delta)),
            Self::Se2(x) => Self::Se2(x.retract(delta)),
            Self::Sim3(x) => Self::Sim3(x.retract(delta)),
            Self::Vector(x) => Self::Vector(x.retract(delta)),
        }
    }
    /// Between values of different spaces the tangent is NaN.
    fn local(&self, other: &Self, out: &mut [f64]) {
        match (self, other) {
            (Self::Se3(x), Self::Se3(y)) => x.local(y, out),
            (Self::Se2(x), Self::Se2(y)) => x.local(y, out),
            (Self::Sim3(x), Self::Sim3(y)) => x.local(y, out),
            (Self::Vector(x), Self::Vector(y)) => x.local(y, out),
            _ => out.fill(f64::NAN),
        }
    }
    fn local_jacobian(&self, other: &Self) -> DMatrix<f64> {
        match (self, other) {
            (Self::Se3(x), Self::Se3(y)) => x.local_jacobian(y),
            (Self::Se2(x), Self::Se2(y)) => x.local_jacobian(y),
            (Self::Sim3(x), Self::Sim3(y)) => x.local_jacobian(y),
            (Self::Vector(x), Self::Vector(y)) => x.local_jacobian(y),
            _ => DMatrix::from_element(self.dof(), self.dof(), f64::NAN),
        }
    }
}

impl Value {
    /// True when every number is finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Se3(x) => {
                x.translation.vector.iter().chain(x.rotation.coords.iter()).all(|v| v.is_finite())
            }
            Self::Se2(x) => x.translation.vector.iter().all(|v| v.is_finite()) && x.rotation.re.is_finite(),
            Self::Sim3(x) => {
                let numbers = x.translation.iter().chain(x.rotation.coords.iter());
                x.scale.is_finite() && numbers.into_iter().all(|v| v.is_finite())
            }
            Self::Vector(x) => x.iter().all(|v| v.is_finite()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn local_inverts_retract(d in proptest::array::uniform7(-1.0..1.0), x in proptest::array::uniform7(-1.0..1.0)) {
            let start: [Value; 4] = [
                Isometry3::identity().retract(&x[..6]).into(),
                Isometry2::identity().retract(&x[..3]).into(),
                Similarity::identity().retract(&x).into(),
                DVector::from_row_slice(&x[..4]).into(),
            ];
            for a in start {
                let n = a.dof();
                let mut back = vec![0.0; n];
                a.local(&a.retract(&d[..n]), &mut back);
                for (b, d) in back.iter().zip(&d) {
                    prop_assert!((b - d).abs() < 1e-11);
                }
            }
        }
    }
}
