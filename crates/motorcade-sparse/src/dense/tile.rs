//! Register tiles: `−A Bᵀ` of a few rows and columns of a panel.

use super::lanes::fma;
use crate::simd::Four;

/// Columns of a strip, those of one SE(3) variable; also the columns of the register tile.
pub(super) const STRIP: usize = 6;

/// `−Σ_p a[i, p] · a[j, p]` of an R×N tile at rows i and j of all `columns`, of leading dimension `ld`.
#[inline(always)]
pub(super) fn product<const R: usize, const N: usize, V: Four>(
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
                sum[c][r] = fma::<V>(-x[r], y[c], sum[c][r]);
            }
        }
    }
    sum
}

/// Runs `$tile::<R, ..>(.., row, ..)` over all rows from `$start`, in tiles of 8 with short ones up to the first
/// multiple of the lanes and at the end.
macro_rules! for_rows {
    ($start:expr, $end:expr, |$i:ident, $r:ident| $call:expr) => {{
        let mut $i = $start;
        while $i % super::lanes::LANES != 0 && $i < $end {
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
pub(super) use for_rows;
