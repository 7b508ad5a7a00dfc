//! Schur complement `−L21 L21ᵀ` of a panel.

use super::shape::Shape;
use super::tile::{STRIP, product};
use crate::simd::{Four, Kernel, dispatch};
use crate::stop::Lookout;
use crate::unfactorised::Unfactorised;

#[inline(always)]
fn schur_tile<const R: usize, const N: usize, V: Four>(
    panel: &[f64],
    shape: Shape,
    (i, j): (usize, usize),
    out: &mut [f64],
) -> Option<()> {
    let (below, ldc) = (shape.below_start(), shape.schur_ld());
    let sum = product::<R, N, V>(panel, shape.ld(), below + i, below + j);
    for c in 0..N {
        *out.get_mut((j + c) * ldc + i..)?.first_chunk_mut::<R>()? = sum[c];
    }
    Some(())
}

#[inline(always)]
fn schur_columns<const N: usize, V: Four>(
    panel: &[f64],
    shape: Shape,
    j: usize,
    out: &mut [f64],
) -> Option<()> {
    // Starting at the tile above the diagonal writes scratch into the upper triangle, which is never read.
    let mut i = j / super::lanes::LANES * super::lanes::LANES;
    while i + 8 <= shape.schur_ld() {
        schur_tile::<8, N, V>(panel, shape, (i, j), out)?;
        i += 8;
    }
    if i < shape.schur_ld() {
        schur_tile::<4, N, V>(panel, shape, (i, j), out)?;
    }
    Some(())
}

/// Writes the lower triangle of `−L21 L21ᵀ`; the upper triangle of `out` is scratch.
#[inline(always)]
fn schur<V: Four>(
    panel: &[f64],
    shape: Shape,
    out: &mut [f64],
    lookout: &mut Lookout<'_>,
) -> Result<(), Unfactorised> {
    let panel = panel.get(..shape.len()).unwrap_or(&[]);
    let mut j = 0;
    while j + STRIP <= shape.below {
        let _complete = schur_columns::<STRIP, V>(panel, shape, j, out);
        if lookout.stops_after((shape.pivots * (shape.below - j) * STRIP) as f64) {
            return Err(Unfactorised::Stopped);
        }
        j += STRIP;
    }
    while j + 3 <= shape.below {
        let _complete = schur_columns::<3, V>(panel, shape, j, out);
        j += 3;
    }
    while j < shape.below {
        let _complete = schur_columns::<1, V>(panel, shape, j, out);
        j += 1;
    }
    Ok(())
}

struct SchurComplement<'a, 'b> {
    panel: &'a [f64],
    shape: Shape,
    out: &'a mut [f64],
    lookout: &'a mut Lookout<'b>,
}

impl Kernel for SchurComplement<'_, '_> {
    type Output = Result<(), Unfactorised>;
    #[inline(always)]
    fn run<V: Four>(self) -> Result<(), Unfactorised> {
        schur::<V>(self.panel, self.shape, self.out, self.lookout)
    }
}

/// Writes the lower triangle of `−L21 L21ᵀ`; the upper triangle of `out` is scratch.
///
/// # Errors
/// A request to stop.
pub(crate) fn schur_complement(
    panel: &[f64],
    shape: Shape,
    out: &mut [f64],
    lookout: &mut Lookout<'_>,
) -> Result<(), Unfactorised> {
    dispatch(SchurComplement { panel, shape, out, lookout })
}
