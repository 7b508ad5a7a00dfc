//! 6×6 matrices of SE(3) Jacobians, which in `[ω, ν]` order are lower block triangular: `[[a, 0], [b, c]]`.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// `[[a, 0], [b, c]]` with 3×3 blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LowerBlocks {
    pub a: Matrix3<f64>,
    pub b: Matrix3<f64>,
    pub c: Matrix3<f64>,
}

/// A symmetric 6×6 matrix `[[p, qᵀ], [q, s]]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Symmetric {
    pub p: Matrix3<f64>,
    pub q: Matrix3<f64>,
    pub s: Matrix3<f64>,
}

impl Symmetric {
    pub(crate) fn from_matrix(m: &Matrix6<f64>) -> Self {
        Self {
            p: m.fixed_view::<3, 3>(0, 0).into_owned(),
            q: m.fixed_view::<3, 3>(3, 0).into_owned(),
            s: m.fixed_view::<3, 3>(3, 3).into_owned(),
        }
    }

    #[inline]
    pub(crate) fn times(&self, x: &Vector3<f64>, y: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (self.p * x + self.q.tr_mul(y), self.q * x + self.s * y)
    }
}

impl LowerBlocks {
    /// `self · other`.
    #[inline]
    pub(crate) fn mul(&self, other: &Self) -> Self {
        Self { a: self.a * other.a, b: self.b * other.a + self.c * other.b, c: self.c * other.c }
    }

    #[inline]
    pub(crate) fn tr_mul(&self, x: &Vector3<f64>, y: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (self.a.tr_mul(x) + self.b.tr_mul(y), self.c.tr_mul(y))
    }

    /// `m · self` as its four blocks (11, 12, 21, 22).
    #[inline]
    pub(crate) fn after(&self, m: &Symmetric) -> [Matrix3<f64>; 4] {
        let qt = m.q.transpose();
        [m.p * self.a + qt * self.b, qt * self.c, m.q * self.a + m.s * self.b, m.s * self.c]
    }

    /// `selfᵀ · m` where the result is symmetric: only the blocks 11, 21 and 22 are computed.
    #[inline]
    pub(crate) fn congruence(&self, m: &[Matrix3<f64>; 4]) -> Symmetric {
        Symmetric {
            p: self.a.tr_mul(&m[0]) + self.b.tr_mul(&m[2]),
            q: self.c.tr_mul(&m[2]),
            s: self.c.tr_mul(&m[3]),
        }
    }

    pub(crate) fn to_matrix(self) -> Matrix6<f64> {
        let mut m = Matrix6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.a);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.b);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.c);
        m
    }
}

/// Writes a 3×3 block at (row, column) of a column-major matrix with leading dimension 12.
#[inline]
pub(crate) fn put(h: &mut [f64; 144], row: usize, column: usize, m: &Matrix3<f64>, sign: f64) {
    for j in 0..3 {
        for i in 0..3 {
            h[(column + j) * 12 + row + i] = sign * m[(i, j)];
        }
    }
}

#[inline]
pub(crate) fn join(x: &Vector3<f64>, y: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(x.x, x.y, x.z, y.x, y.y, y.z)
}
