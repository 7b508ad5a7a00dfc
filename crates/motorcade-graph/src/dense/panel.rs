//! Cholesky of one supernode: a tall panel `[L11; L21]` and its Schur complement `−L21 L21ᵀ`.
//!
//! The panel is factorised left-looking in strips of six columns (one SE(3) variable): every strip tile is loaded
//! once, updated by all finished columns in registers, solved against the strip's triangle and stored once.

use super::{fma, padded};

/// Columns of a strip; also the columns of the register tile.
const STRIP: usize = 6;

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

/// Smallest and largest diagonal entry of a factor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pivots {
    pub smallest: f64,
    pub largest: f64,
}

/// `−Σ_p a[i, p] · a[j, p]` of an R×N tile at rows i and j of all `columns`, of leading dimension `ld`.
#[inline(always)]
fn product<const R: usize, const N: usize, const FMA: bool>(
    columns: &[f64],
    ld: usize,
    i: usize,
    j: usize,
) -> [[f64; R]; N] {
    let (mut sum, mut columns) = ([[0.0; R]; N], columns);
    // One check a column: that the rows are inside does not change from column to column.
    while let Some((column, rest)) = columns.split_at_checked(ld) {
        columns = rest;
        let (Some(x), Some(y)) = (
            column.get(i..).and_then(|s| s.first_chunk::<R>()),
            column.get(j..).and_then(|s| s.first_chunk::<N>()),
        ) else {
            break;
        };
        for c in 0..N {
            for r in 0..R {
                sum[c][r] = fma::<FMA>(-x[r], y[c], sum[c][r]);
            }
        }
    }
    sum
}

/// The factorised triangle of one strip: rows below the diagonal and reciprocal diagonal.
struct Triangle<const N: usize> {
    lower: [[f64; N]; N],
    inverse: [f64; N],
}

/// Updates and factorises the N×N diagonal block at `j0`.
#[inline(always)]
fn diagonal<const N: usize, const FMA: bool>(
    done: &[f64],
    strip: &mut [f64],
    ld: usize,
    j0: usize,
    pivots: &mut Pivots,
) -> Option<Triangle<N>> {
    let sum = product::<N, N, FMA>(done, ld, j0, j0);
    let mut l = [[0.0; N]; N]; // l[column][row]
    for j in 0..N {
        let column = strip.get(j * ld + j0..)?.first_chunk::<N>()?;
        for i in j..N {
            l[j][i] = column[i] + sum[j][i];
        }
    }
    let mut inverse = [0.0; N];
    for j in 0..N {
        let d = l[j][j];
        if !(d > 0.0 && d.is_finite()) {
            return None;
        }
        let root = d.sqrt();
        pivots.smallest = pivots.smallest.min(root);
        pivots.largest = pivots.largest.max(root);
        inverse[j] = 1.0 / root;
        l[j][j] = root;
        for i in j + 1..N {
            l[j][i] *= inverse[j];
        }
        for c in j + 1..N {
            for i in c..N {
                l[c][i] = fma::<FMA>(-l[j][i], l[j][c], l[c][i]);
            }
        }
    }
    for j in 0..N {
        let column = strip.get_mut(j * ld + j0..)?.first_chunk_mut::<N>()?;
        column[j..].copy_from_slice(&l[j][j..]);
    }
    Some(Triangle { lower: l, inverse })
}

/// Updates R rows of the strip from row `i` by the finished columns.
#[inline(always)]
fn update<const R: usize, const N: usize, const FMA: bool>(
    done: &[f64],
    strip: &mut [f64],
    ld: usize,
    j0: usize,
    i: usize,
) -> Option<()> {
    let sum = product::<R, N, FMA>(done, ld, i, j0);
    for j in 0..N {
        let column = strip.get_mut(j * ld + i..)?.first_chunk_mut::<R>()?;
        for r in 0..R {
            column[r] += sum[j][r];
        }
    }
    Some(())
}

/// Solves R rows of the strip against its triangle.
#[inline(always)]
fn solve<const R: usize, const N: usize, const FMA: bool>(
    strip: &mut [f64],
    ld: usize,
    i: usize,
    triangle: &Triangle<N>,
) -> Option<()> {
    let mut x = [[0.0; R]; N];
    for j in 0..N {
        x[j] = *strip.get(j * ld + i..)?.first_chunk::<R>()?;
        for p in 0..j {
            let l = triangle.lower[p][j];
            for r in 0..R {
                x[j][r] = fma::<FMA>(-x[p][r], l, x[j][r]);
            }
        }
        for r in 0..R {
            x[j][r] *= triangle.inverse[j];
        }
    }
    for j in 0..N {
        *strip.get_mut(j * ld + i..)?.first_chunk_mut::<R>()? = x[j];
    }
    Some(())
}

/// Runs `$tile::<R, ..>(.., row, ..)` over all rows from `$start`, in tiles of 8 with short ones up to the first
/// multiple of the lanes and at the end.
macro_rules! for_rows {
    ($start:expr, $end:expr, |$i:ident, $r:ident| $call:expr) => {{
        let mut $i = $start;
        while $i % super::LANES != 0 && $i < $end {
            if $i % 2 == 0 {
                const $r: usize = 2;
                $call;
                $i += 2;
            } else {
                const $r: usize = 1;
                $call;
                $i += 1;
            }
        }
        while $i + 8 <= $end {
            const $r: usize = 8;
            $call;
            $i += 8;
        }
        if $i < $end {
            const $r: usize = 4;
            $call;
        }
    }};
}

/// Two passes over the rows below the diagonal, update and solve: fused in one loop they would be vectorised
/// worse, and the strip stays in the cache between them.
#[inline(always)]
fn strip<const N: usize, const FMA: bool>(
    panel: &mut [f64],
    shape: Shape,
    j0: usize,
    pivots: &mut Pivots,
) -> Option<()> {
    let ld = shape.ld();
    let (done, rest) = panel.split_at_mut_checked(j0 * ld)?;
    let triangle = diagonal::<N, FMA>(done, rest, ld, j0, pivots)?;
    if j0 > 0 {
        for_rows!(j0 + N, ld, |i, R| update::<R, N, FMA>(done, rest, ld, j0, i)?);
    }
    for_rows!(j0 + N, ld, |i, R| solve::<R, N, FMA>(rest, ld, i, &triangle)?);
    Some(())
}

/// Factorises the pivots of a panel in place; the strictly upper triangle is scratch. `None` when the matrix is not
/// positive definite.
#[inline(always)]
pub(crate) fn factor<const FMA: bool>(panel: &mut [f64], shape: Shape) -> Option<Pivots> {
    let mut pivots = Pivots { smallest: f64::INFINITY, largest: 0.0 };
    let mut j = 0;
    while j + STRIP <= shape.pivots {
        strip::<STRIP, FMA>(panel, shape, j, &mut pivots)?;
        j += STRIP;
    }
    while j + 3 <= shape.pivots {
        strip::<3, FMA>(panel, shape, j, &mut pivots)?;
        j += 3;
    }
    while j < shape.pivots {
        strip::<1, FMA>(panel, shape, j, &mut pivots)?;
        j += 1;
    }
    Some(pivots)
}

#[inline(always)]
fn schur_tile<const R: usize, const N: usize, const FMA: bool>(
    panel: &[f64],
    shape: Shape,
    (i, j): (usize, usize),
    out: &mut [f64],
) -> Option<()> {
    let (below, ldc) = (shape.below_start(), shape.schur_ld());
    let sum = product::<R, N, FMA>(panel, shape.ld(), below + i, below + j);
    for c in 0..N {
        *out.get_mut((j + c) * ldc + i..)?.first_chunk_mut::<R>()? = sum[c];
    }
    Some(())
}

#[inline(always)]
fn schur_columns<const N: usize, const FMA: bool>(
    panel: &[f64],
    shape: Shape,
    j: usize,
    out: &mut [f64],
) -> Option<()> {
    // Starting at the tile above the diagonal writes scratch into the upper triangle, which nobody reads.
    let mut i = j / super::LANES * super::LANES;
    while i + 8 <= shape.schur_ld() {
        schur_tile::<8, N, FMA>(panel, shape, (i, j), out)?;
        i += 8;
    }
    if i < shape.schur_ld() {
        schur_tile::<4, N, FMA>(panel, shape, (i, j), out)?;
    }
    Some(())
}

/// Writes the lower triangle of `−L21 L21ᵀ`; the upper triangle of `out` is scratch.
#[inline(always)]
pub(crate) fn schur<const FMA: bool>(panel: &[f64], shape: Shape, out: &mut [f64]) {
    let panel = panel.get(..shape.len()).unwrap_or(&[]);
    let mut j = 0;
    while j + STRIP <= shape.below {
        let _complete = schur_columns::<STRIP, FMA>(panel, shape, j, out);
        j += STRIP;
    }
    while j + 3 <= shape.below {
        let _complete = schur_columns::<3, FMA>(panel, shape, j, out);
        j += 3;
    }
    while j < shape.below {
        let _complete = schur_columns::<1, FMA>(panel, shape, j, out);
        j += 1;
    }
}

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
fn subtract<const R: usize, const N: usize, const FMA: bool>(
    columns: &Columns<'_, N>,
    x: &[f64; N],
    i: usize,
    front: &mut [f64],
) -> Option<()> {
    let (rows, v) = (columns.rows::<R>(i)?, front.get_mut(i..)?.first_chunk_mut::<R>()?);
    for p in 0..N {
        for k in 0..R {
            v[k] = fma::<FMA>(-rows[p][k], x[p], v[k]);
        }
    }
    Some(())
}

/// `sum_p += l_p v` over R rows from row `i` on, kept apart by row.
#[inline(always)]
fn add_products<const R: usize, const N: usize, const FMA: bool>(
    columns: &Columns<'_, N>,
    i: usize,
    front: &[f64],
    sums: &mut [[f64; R]; N],
) -> Option<()> {
    let (rows, v) = (columns.rows::<R>(i)?, front.get(i..)?.first_chunk::<R>()?);
    for p in 0..N {
        for k in 0..R {
            sums[p][k] = fma::<FMA>(rows[p][k], v[k], sums[p][k]);
        }
    }
    Some(())
}

#[inline(always)]
fn forward_strip<const N: usize, const FMA: bool>(
    panel: &[f64],
    ld: usize,
    j0: usize,
    front: &mut [f64],
) -> Option<()> {
    let strip = Columns::<N>::new(panel, ld, j0)?;
    let x = front.get_mut(j0..)?.first_chunk_mut::<N>()?;
    for c in 0..N {
        for p in 0..c {
            x[c] = fma::<FMA>(-strip.columns[p][j0 + c], x[p], x[c]);
        }
        x[c] *= strip.inverse[c];
    }
    let x = *x;
    for_rows!(j0 + N, ld, |i, R| subtract::<R, N, FMA>(&strip, &x, i, front)?);
    Some(())
}

#[inline(always)]
fn backward_strip<const N: usize, const FMA: bool>(
    panel: &[f64],
    ld: usize,
    j0: usize,
    front: &mut [f64],
) -> Option<()> {
    let strip = Columns::<N>::new(panel, ld, j0)?;
    let (mut i, mut sums) = (j0 + N, [0.0; N]);
    while i % super::LANES != 0 && i < ld {
        let row = strip.rows::<1>(i)?;
        for p in 0..N {
            sums[p] = fma::<FMA>(row[p][0], front[i], sums[p]);
        }
        i += 1;
    }
    let mut wide = [[0.0; super::LANES]; N];
    while i < ld {
        add_products::<{ super::LANES }, N, FMA>(&strip, i, front, &mut wide)?;
        i += super::LANES;
    }
    let x = front.get_mut(j0..)?.first_chunk_mut::<N>()?;
    for c in (0..N).rev() {
        let [s, t, u, v] = wide[c];
        let mut y = x[c] - (sums[c] + ((s + u) + (t + v)));
        for p in c + 1..N {
            y = fma::<FMA>(-strip.columns[c][j0 + p], x[p], y);
        }
        x[c] = y * strip.inverse[c];
    }
    Some(())
}

/// Forward substitution over a front, rows as in the panel: solves `L11 y = x` in place at the pivots and subtracts
/// `L21 y` from the rows below.
#[inline(always)]
pub(crate) fn forward<const FMA: bool>(panel: &[f64], shape: Shape, front: &mut [f64]) {
    let (ld, mut j) = (shape.ld(), 0);
    while j + STRIP <= shape.pivots {
        let _complete = forward_strip::<STRIP, FMA>(panel, ld, j, front);
        j += STRIP;
    }
    while j < shape.pivots {
        let _complete = forward_strip::<1, FMA>(panel, ld, j, front);
        j += 1;
    }
}

/// Backward substitution over a front, rows as in the panel: solves `L11ᵀ y = x − L21ᵀ below` in place at the pivots.
#[inline(always)]
pub(crate) fn backward<const FMA: bool>(panel: &[f64], shape: Shape, front: &mut [f64]) {
    let (ld, mut j) = (shape.ld(), shape.pivots);
    while j % STRIP != 0 {
        j -= 1;
        let _complete = backward_strip::<1, FMA>(panel, ld, j, front);
    }
    while j > 0 {
        j -= STRIP;
        let _complete = backward_strip::<STRIP, FMA>(panel, ld, j, front);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;
    use nalgebra::DMatrix;

    fn check(pivots: usize, below: usize) {
        let n = pivots + below;
        let shape = Shape { pivots, below };
        let g = DMatrix::from_fn(n, n, |i, j| ((i * 37 + j * 101 + 13) % 29) as f64 / 29.0 - 0.5);
        let a = &g * g.transpose() + DMatrix::identity(n, n);
        let row = |i: usize| if i < pivots { i } else { i - pivots + shape.below_start() };
        let mut panel = vec![0.0; shape.len()];
        for j in 0..pivots {
            for i in j..n {
                panel[j * shape.ld() + row(i)] = a[(i, j)];
            }
        }
        let mut plain = panel.clone();
        let expected = a.clone().cholesky().unwrap().l();
        assert!(simd::factor_panel(&mut panel, shape).is_some());
        assert!(factor::<false>(&mut plain, shape).is_some());
        let mut out = vec![0.0; shape.schur_len()];
        simd::schur_complement(&panel, shape, &mut out);
        let l21 = expected.view((pivots, 0), (below, pivots)).into_owned();
        let schur = &l21 * l21.transpose();
        for j in 0..pivots {
            for i in j..n {
                let at = j * shape.ld() + row(i);
                assert!((panel[at] - expected[(i, j)]).abs() < 1e-10, "{pivots} {below} {i} {j}");
                assert!((plain[at] - expected[(i, j)]).abs() < 1e-10);
            }
        }
        for j in 0..below {
            for i in j..below {
                assert!((out[j * shape.schur_ld() + i] + schur[(i, j)]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn panels_of_all_shapes_match_dense_cholesky() {
        for pivots in [1, 2, 3, 4, 6, 7, 9, 12, 18, 25, 30, 120] {
            for below in [0, 1, 3, 5, 6, 12, 19, 30, 42, 137] {
                check(pivots, below);
            }
        }
    }

    #[test]
    fn indefinite_panel_is_refused() {
        let shape = Shape { pivots: 6, below: 0 };
        let mut panel = vec![0.0; shape.len()];
        for j in 0..6 {
            panel[j * shape.ld() + j] = if j == 4 { -1.0 } else { 1.0 };
        }
        assert!(simd::factor_panel(&mut panel, shape).is_none());
    }
}
