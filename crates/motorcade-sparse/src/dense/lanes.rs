//! Vector lanes: padding and fused multiply-add.

use crate::simd::Four;

/// Rows are padded to a multiple of this, so that vector tiles need no masks; the padding is zero.
pub(super) const LANES: usize = 4;

/// `a·b + c`, by one instruction where the code around is compiled for it: without, `mul_add` is a library call, a
/// hundred times slower.
#[inline(always)]
pub(super) fn fma<V: Four>(a: f64, b: f64, c: f64) -> f64 {
    if V::FMA { a.mul_add(b, c) } else { a * b + c }
}

/// `n` rounded up to a multiple of [`LANES`].
pub(super) const fn padded(n: usize) -> usize {
    n.div_ceil(LANES) * LANES
}
