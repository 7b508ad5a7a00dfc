//! 3×3 matrices whose columns fill a four-lane register; the fourth lane is scratch.
//!
//! Nothing here goes through a closure: those are compiled without the features of the kernel they end up in and are
//! not always inlined.

use motorcade_sparse::simd::Four;
use nalgebra::{Matrix3, Quaternion, Vector3};

/// Three numbers and a scratch lane.
pub(super) type Lanes = [f64; 4];

/// Columns of a 3×3 matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mat3<V>(pub [V; 3]);

#[inline(always)]
pub(super) fn lanes(v: &Vector3<f64>) -> Lanes {
    [v.x, v.y, v.z, 0.0]
}

#[inline(always)]
pub(super) fn dot(a: &Lanes, b: &Lanes) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross(a: &Lanes, b: &Lanes) -> Lanes {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0]
}

impl<V: Four> Mat3<V> {
    #[inline(always)]
    fn new(columns: [Lanes; 3]) -> Self {
        let [a, b, c] = columns;
        Self([V::new(a), V::new(b), V::new(c)])
    }

    #[inline(always)]
    pub(super) fn identity(s: f64) -> Self {
        Self::new([[s, 0.0, 0.0, 0.0], [0.0, s, 0.0, 0.0], [0.0, 0.0, s, 0.0]])
    }

    /// `s·w^`.
    #[inline(always)]
    pub(super) fn hat(w: &Lanes, s: f64) -> Self {
        let (x, y, z) = (s * w[0], s * w[1], s * w[2]);
        Self::new([[0.0, z, -y, 0.0], [-z, 0.0, x, 0.0], [y, -x, 0.0, 0.0]])
    }

    /// The rotation of a unit quaternion.
    #[inline(always)]
    pub(super) fn rotation(q: &Quaternion<f64>) -> Self {
        let (x2, y2, z2) = (q.i + q.i, q.j + q.j, q.k + q.k);
        let (xx, yy, zz) = (q.i * x2, q.j * y2, q.k * z2);
        let (xy, xz, yz) = (q.i * y2, q.i * z2, q.j * z2);
        let (wx, wy, wz) = (q.w * x2, q.w * y2, q.w * z2);
        Self::new([
            [1.0 - (yy + zz), xy + wz, xz - wy, 0.0],
            [xy - wz, 1.0 - (xx + zz), yz + wx, 0.0],
            [xz + wy, yz - wx, 1.0 - (xx + yy), 0.0],
        ])
    }

    /// The 3×3 block at (row, column) of a 6×6 matrix given by columns.
    #[inline(always)]
    pub(super) fn block(m: &[[f64; 6]; 6], row: usize, column: usize) -> Self {
        let (a, b, c) = (&m[column], &m[column + 1], &m[column + 2]);
        Self::new([
            [a[row], a[row + 1], a[row + 2], 0.0],
            [b[row], b[row + 1], b[row + 2], 0.0],
            [c[row], c[row + 1], c[row + 2], 0.0],
        ])
    }

    #[inline(always)]
    pub(super) fn transpose(&self) -> Self {
        Self(V::transpose(self.0))
    }

    /// `self · x`.
    #[inline(always)]
    pub(super) fn times(&self, x: &Lanes) -> V {
        let [a, b, c] = self.0;
        a.scale_add(x[0], b.scale_add(x[1], c.scale(x[2])))
    }

    #[inline(always)]
    fn times_add(&self, x: &Lanes, sum: V) -> V {
        let [a, b, c] = self.0;
        a.scale_add(x[0], b.scale_add(x[1], c.scale_add(x[2], sum)))
    }

    /// `self · other`.
    #[inline(always)]
    pub(super) fn mul(&self, other: &Self) -> Self {
        let [x, y, z] = other.0;
        Self([self.times(&x.get()), self.times(&y.get()), self.times(&z.get())])
    }

    /// `sum + self · other`.
    #[inline(always)]
    pub(super) fn mul_add(&self, other: &Self, sum: &Self) -> Self {
        let ([x, y, z], [s, t, u]) = (other.0, sum.0);
        Self([self.times_add(&x.get(), s), self.times_add(&y.get(), t), self.times_add(&z.get(), u)])
    }

    /// `self + other`.
    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([a.add(x), b.add(y), c.add(z)])
    }

    /// `self + s·x yᵀ`.
    #[inline(always)]
    pub(super) fn plus_outer(&self, s: f64, x: &Lanes, y: &Lanes) -> Self {
        let x = V::new(*x);
        let [a, b, c] = self.0;
        Self([x.scale_add(s * y[0], a), x.scale_add(s * y[1], b), x.scale_add(s * y[2], c)])
    }

    pub(super) fn to_matrix(self) -> Matrix3<f64> {
        let columns = self.0.map(V::get);
        Matrix3::from_fn(|i, j| columns[j][i])
    }
}
