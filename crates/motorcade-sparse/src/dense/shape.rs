//! Shape of a supernode's panel.

use super::lanes::padded;

/// Shape of a panel: `pivots` columns; rows are the pivots, padding, then `below` rows, padding.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shape {
    /// Scalar columns eliminated here.
    pub pivots: usize,
    /// Scalar rows under the triangle.
    pub below: usize,
}

impl Shape {
    /// First row under the triangle.
    pub(crate) const fn below_start(self) -> usize {
        padded(self.pivots)
    }
    /// Leading dimension.
    pub(crate) const fn ld(self) -> usize {
        padded(self.pivots) + padded(self.below)
    }
    /// Scalars of the panel.
    pub(crate) const fn len(self) -> usize {
        self.ld() * self.pivots
    }
    /// Leading dimension of the Schur complement.
    pub(crate) const fn schur_ld(self) -> usize {
        padded(self.below)
    }
    /// Scalars of the Schur complement.
    pub(crate) const fn schur_len(self) -> usize {
        padded(self.below) * self.below
    }
}
