//! Cholesky of a panel `[L11; L21]`.
//!
//! The panel is factorised left-looking in strips of six columns (one SE(3) variable): every strip tile is loaded
//! once, updated by all finished columns in registers, solved against the strip's triangle and stored once.

use super::lanes::fma;
use super::shape::Shape;
use super::tile::{STRIP, for_rows, product};
use crate::simd::{Four, Kernel, dispatch};
use crate::stop::Lookout;
use crate::unfactorised::Unfactorised;

/// Smallest and largest diagonal entry of a factor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pivots {
    pub smallest: f64,
    pub largest: f64,
}

/// The factorised triangle of one strip: rows below the diagonal and reciprocal diagonal.
struct Triangle<const N: usize> {
    lower: [[f64; N]; N],
    inverse: [f64; N],
}

/// Updates and factorises the N×N diagonal block at `j0`.
#[inline(always)]
fn diagonal<const N: usize, V: Four>(
    done: &[f64],
    strip: &mut [f64],
    ld: usize,
    j0: usize,
    pivots: &mut Pivots,
) -> Option<Triangle<N>> {
    let sum = product::<N, N, V>(done, ld, j0, j0);
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
                l[c][i] = fma::<V>(-l[j][i], l[j][c], l[c][i]);
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
fn update<const R: usize, const N: usize, V: Four>(
    done: &[f64],
    strip: &mut [f64],
    ld: usize,
    j0: usize,
    i: usize,
) -> Option<()> {
    let sum = product::<R, N, V>(done, ld, i, j0);
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
fn solve<const R: usize, const N: usize, V: Four>(
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
                x[j][r] = fma::<V>(-x[p][r], l, x[j][r]);
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

/// Two passes over the rows below the diagonal, update and solve: fused in one loop they would be vectorised
/// worse, and the strip stays in the cache between them.
#[inline(always)]
fn strip<const N: usize, V: Four>(
    panel: &mut [f64],
    shape: Shape,
    j0: usize,
    pivots: &mut Pivots,
) -> Option<()> {
    let ld = shape.ld();
    let (done, rest) = panel.split_at_mut_checked(j0 * ld)?;
    let triangle = diagonal::<N, V>(done, rest, ld, j0, pivots)?;
    if j0 > 0 {
        for_rows!(j0 + N, ld, |i, R| update::<R, N, V>(done, rest, ld, j0, i)?);
    }
    for_rows!(j0 + N, ld, |i, R| solve::<R, N, V>(rest, ld, i, &triangle)?);
    Some(())
}

/// Factorises the pivots of a panel in place; the strictly upper triangle is scratch.
#[inline(always)]
fn factor<V: Four>(
    panel: &mut [f64],
    shape: Shape,
    lookout: &mut Lookout<'_>,
) -> Result<Pivots, Unfactorised> {
    let mut pivots = Pivots { smallest: f64::INFINITY, largest: 0.0 };
    let mut j = 0;
    while j + STRIP <= shape.pivots {
        strip::<STRIP, V>(panel, shape, j, &mut pivots).ok_or(Unfactorised::NotPositiveDefinite)?;
        j += STRIP;
        // The columns before this strip times its rows and columns.
        if lookout.stops_after((j * (shape.ld() - j) * STRIP) as f64) {
            return Err(Unfactorised::Stopped);
        }
    }
    while j + 3 <= shape.pivots {
        strip::<3, V>(panel, shape, j, &mut pivots).ok_or(Unfactorised::NotPositiveDefinite)?;
        j += 3;
    }
    while j < shape.pivots {
        strip::<1, V>(panel, shape, j, &mut pivots).ok_or(Unfactorised::NotPositiveDefinite)?;
        j += 1;
    }
    Ok(pivots)
}

struct FactorPanel<'a, 'b> {
    panel: &'a mut [f64],
    shape: Shape,
    lookout: &'a mut Lookout<'b>,
}

impl Kernel for FactorPanel<'_, '_> {
    type Output = Result<Pivots, Unfactorised>;
    #[inline(always)]
    fn run<V: Four>(self) -> Result<Pivots, Unfactorised> {
        factor::<V>(self.panel, self.shape, self.lookout)
    }
}

/// Factorises the pivots of a panel in place; the strictly upper triangle is scratch.
///
/// # Errors
/// A pivot that is not positive, a request to stop.
pub(crate) fn factor_panel(
    panel: &mut [f64],
    shape: Shape,
    lookout: &mut Lookout<'_>,
) -> Result<Pivots, Unfactorised> {
    dispatch(FactorPanel { panel, shape, lookout })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::schur_complement;
    use crate::simd::Plain;
    use crate::stop::Stop;
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
        let mut lookout = Lookout::new(Stop::NEVER, 0.0);
        assert!(factor_panel(&mut panel, shape, &mut lookout).is_ok());
        assert!(factor::<Plain>(&mut plain, shape, &mut lookout).is_ok());
        let mut out = vec![0.0; shape.schur_len()];
        schur_complement(&panel, shape, &mut out, &mut lookout).unwrap();
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
        let found = factor_panel(&mut panel, shape, &mut Lookout::new(Stop::NEVER, 0.0));
        assert_eq!(found.err(), Some(Unfactorised::NotPositiveDefinite));
    }
}
