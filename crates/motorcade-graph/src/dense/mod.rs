//! Dense kernels of the sparse factorisation. All matrices are column-major.

pub(crate) mod panel;
pub(crate) mod simd;

/// Rows are padded to a multiple of this, so that vector tiles need no masks; the padding is zero.
pub(crate) const LANES: usize = 4;

/// `n` rounded up to a multiple of [`LANES`].
pub(crate) const fn padded(n: usize) -> usize {
    n.div_ceil(LANES) * LANES
}
