//! Triangular solves with a panel.

use super::lanes::fma;
use super::shape::Shape;
use super::tile::{STRIP, for_rows};
use crate::simd::{Four, Kernel, dispatch};

/// N columns of a panel from `j0` on, as the triangular solves need them.
struct Columns<'a, const N: usize> {
    columns: [&'a [f64]; N],
    /// Reciprocals of the diagonal.
    inverse: [f64; N],
}

impl<'a, const N: usize> Columns<'a, N> {
    #[inline(always)]
    fn new(panel: &'a [f64], ld: usize, j0: usize) -> Option<Self> {
        let mut columns: [&[f64]; N] = [&[]; N];
        for (p, column) in columns.iter_mut().enumerate() {
            *column = panel.get((j0 + p) * ld..(j0 + p + 1) * ld)?;
        }
        let inverse = std::array::from_fn(|p| 1.0 / columns[p][j0 + p]);
        Some(Self { columns, inverse })
    }

    /// R rows of all columns from row `i` on.
    #[inline(always)]
    fn rows<const R: usize>(&self, i: usize) -> Option<[[f64; R]; N]> {
        let mut rows = [[0.0; R]; N];
        for p in 0..N {
            rows[p] = *self.columns[p].get(i..)?.first_chunk()?;
        }
        Some(rows)
    }
}

/// `v −= Σ_p x_p l_p` over R rows from row `i` on.
#[inline(always)]
fn subtract<const R: usize, const N: usize, V: Four>(
    columns: &Columns<'_, N>,
    x: &[f64; N],
    i: usize,
    front: &mut [f64],
) -> Option<()> {
    let (rows, v) = (columns.rows::<R>(i)?, front.get_mut(i..)?.first_chunk_mut::<R>()?);
    for p in 0..N {
        for k in 0..R {
            v[k] = fma::<V>(-rows[p][k], x[p], v[k]);
        }
    }
    Some(())
}

/// `sum_p += l_p v` over R rows from row `i` on, kept apart by row.
#[inline(always)]
fn add_products<const R: usize, const N: usize, V: Four>(
    columns: &Columns<'_, N>,
    i: usize,
    front: &[f64],
    sums: &mut [[f64; R]; N],
) -> Option<()> {
    let (rows, v) = (columns.rows::<R>(i)?, front.get(i..)?.first_chunk::<R>()?);
    for p in 0..N {
        for k in 0..R {
            sums[p][k] = fma::<V>(rows[p][k], v[k], sums[p][k]);
        }
    }
    Some(())
}

#[inline(always)]
fn forward_strip<const N: usize, V: Four>(
    panel: &[f64],
    ld: usize,
    j0: usize,
    front: &mut [f64],
) -> Option<()> {
    let strip = Columns::<N>::new(panel, ld, j0)?;
    let x = front.get_mut(j0..)?.first_chunk_mut::<N>()?;
    for c in 0..N {
        for p in 0..c {
            x[c] = fma::<V>(-strip.columns[p][j0 + c], x[p], x[c]);
        }
        x[c] *= strip.inverse[c];
    }
    let x = *x;
    for_rows!(j0 + N, ld, |i, R| subtract::<R, N, V>(&strip, &x, i, front)?);
    Some(())
}

#[inline(always)]
fn backward_strip<const N: usize, V: Four>(
    panel: &[f64],
    ld: usize,
    j0: usize,
    front: &mut [f64],
) -> Option<()> {
    let strip = Columns::<N>::new(panel, ld, j0)?;
    let (mut i, mut sums) = (j0 + N, [0.0; N]);
    while i % super::lanes::LANES != 0 && i < ld {
        let row = strip.rows::<1>(i)?;
        for p in 0..N {
            sums[p] = fma::<V>(row[p][0], front[i], sums[p]);
        }
        i += 1;
    }
    let mut wide = [[0.0; super::lanes::LANES]; N];
    while i < ld {
        add_products::<{ super::lanes::LANES }, N, V>(&strip, i, front, &mut wide)?;
        i += super::lanes::LANES;
    }
    let x = front.get_mut(j0..)?.first_chunk_mut::<N>()?;
    for c in (0..N).rev() {
        let [s, t, u, v] = wide[c];
        let mut y = x[c] - (sums[c] + ((s + u) + (t + v)));
        for p in c + 1..N {
            y = fma::<V>(-strip.columns[c][j0 + p], x[p], y);
        }
        x[c] = y * strip.inverse[c];
    }
    Some(())
}

/// See [`solve_forward`].
#[inline(always)]
fn forward<V: Four>(panel: &[f64], shape: Shape, front: &mut [f64]) {
    let (ld, mut j) = (shape.ld(), 0);
    while j + STRIP <= shape.pivots {
        let _complete = forward_strip::<STRIP, V>(panel, ld, j, front);
        j += STRIP;
    }
    while j < shape.pivots {
        let _complete = forward_strip::<1, V>(panel, ld, j, front);
        j += 1;
    }
}

/// See [`solve_backward`].
#[inline(always)]
fn backward<V: Four>(panel: &[f64], shape: Shape, front: &mut [f64]) {
    let (ld, mut j) = (shape.ld(), shape.pivots);
    while j % STRIP != 0 {
        j -= 1;
        let _complete = backward_strip::<1, V>(panel, ld, j, front);
    }
    while j > 0 {
        j -= STRIP;
        let _complete = backward_strip::<STRIP, V>(panel, ld, j, front);
    }
}

/// Substitution over a front with L, or with its transpose.
struct Substitution<'a, const TRANSPOSED: bool> {
    panel: &'a [f64],
    shape: Shape,
    front: &'a mut [f64],
}

impl<const TRANSPOSED: bool> Kernel for Substitution<'_, TRANSPOSED> {
    type Output = ();
    #[inline(always)]
    fn run<V: Four>(self) {
        let Self { panel, shape, front } = self;
        if TRANSPOSED { backward::<V>(panel, shape, front) } else { forward::<V>(panel, shape, front) }
    }
}

/// Forward substitution over a front, rows as in the panel: solves `L11 y = x` in place at the pivots and subtracts
/// `L21 y` from the rows below.
pub(crate) fn solve_forward(panel: &[f64], shape: Shape, front: &mut [f64]) {
    dispatch(Substitution::<false> { panel, shape, front });
}

/// Backward substitution over a front, rows as in the panel: solves `L11ᵀ y = x − L21ᵀ below` in place at the pivots.
pub(crate) fn solve_backward(panel: &[f64], shape: Shape, front: &mut [f64]) {
    dispatch(Substitution::<true> { panel, shape, front });
}
