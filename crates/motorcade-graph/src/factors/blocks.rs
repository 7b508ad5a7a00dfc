//! 6×6 matrices of SE(3) Jacobians, which in `[ω, ν]` order are lower block triangular.

use motorcade_sparse::simd::Four;
use nalgebra::Matrix6;
#[cfg(test)]
use nalgebra::{Vector3, Vector6};

use super::mat3::Mat3;

/// `[[a, 0], [u·a, c]]` with 3×3 blocks: the shear `[[I, 0], [u, I]]` after `diag(a, c)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowerBlocks<V> {
    pub u: Mat3<V>,
    pub a: Mat3<V>,
    pub c: Mat3<V>,
}

/// A symmetric 6×6 matrix `[[p, qᵀ], [q, s]]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Symmetric<V> {
    pub p: Mat3<V>,
    pub q: Mat3<V>,
    pub s: Mat3<V>,
}

impl<V: Four> Symmetric<V> {
    #[inline(always)]
    pub(super) fn new(m: &[[f64; 6]; 6]) -> Self {
        Self { p: Mat3::block(m, 0, 0), q: Mat3::block(m, 3, 0), s: Mat3::block(m, 3, 3) }
    }
}

impl<V: Four> LowerBlocks<V> {
    /// `selfᵀ · [x; y]`.
    #[inline(always)]
    pub(super) fn tr_mul(&self, x: V, y: V) -> (V, V) {
        let y = y.get();
        let x = self.u.transpose().times(&y).add(x).get();
        (self.a.transpose().times(&x), self.c.transpose().times(&y))
    }

    /// `m · self` as its blocks 11, 12, 21, 22, and `selfᵀ · m · self`.
    #[inline(always)]
    pub(super) fn congruence(&self, m: &Symmetric<V>) -> ([Mat3<V>; 4], Symmetric<V>) {
        let qt = m.q.transpose();
        let sheared = (qt.mul_add(&self.u, &m.p), m.s.mul_add(&self.u, &m.q));
        let half = [sheared.0.mul(&self.a), qt.mul(&self.c), sheared.1.mul(&self.a), m.s.mul(&self.c)];
        let (at, ct) = (self.a.transpose(), self.c.transpose());
        let p = at.mul(&self.u.transpose().mul_add(&half[2], &half[0]));
        (half, Symmetric { p, q: ct.mul(&half[2]), s: ct.mul(&half[3]) })
    }

    pub(super) fn to_matrix(self) -> Matrix6<f64> {
        let mut m = Matrix6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.a.to_matrix());
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.u.mul(&self.a).to_matrix());
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.c.to_matrix());
        m
    }
}

/// Writes `sign` times three columns of six rows at (row, column) of a column-major matrix with leading dimension 12.
#[inline(always)]
pub(super) fn put<V: Four>(
    h: &mut [f64; 144],
    (row, column): (usize, usize),
    top: &Mat3<V>,
    bottom: &Mat3<V>,
    sign: f64,
) {
    for j in 0..3 {
        let at = (column + j) * 12 + row;
        let (four, two) = V::join(top.0[j].scale(sign), bottom.0[j].scale(sign));
        h[at..at + 4].copy_from_slice(&four);
        h[at + 4..at + 6].copy_from_slice(&two);
    }
}

#[cfg(test)]
pub(super) fn join(x: &Vector3<f64>, y: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(x.x, x.y, x.z, y.x, y.y, y.z)
}
