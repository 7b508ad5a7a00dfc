//! Extend-add: a child's Schur complement added to its parent's front.

use crate::simd::{Four, Kernel, dispatch};
use crate::symbolic::Run;

/// Places of the runs of a child in its parent: in the panel, or in the Schur complement, which begins `shift` rows and
/// columns later.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PanelRuns<'a> {
    /// Runs of rows from the first column on.
    pub runs: &'a [Run],
    /// Number of runs that are columns here as well.
    pub columns: usize,
    pub shift: usize,
    /// Leading dimension of the parent's part.
    pub ld: usize,
}

struct ExtendAdd<'a> {
    schur: &'a [f64],
    ld: usize,
    place: PanelRuns<'a>,
    target: &'a mut [f64],
}

impl Kernel for ExtendAdd<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Four>(self) {
        run::<V>(self.schur, self.ld, self.place, self.target);
    }
}

/// Adds the lower triangle of the columns of `schur` (leading dimension `ld`) to `target`, whose upper triangle is scratch.
pub(crate) fn extend_add(schur: &[f64], ld: usize, place: PanelRuns<'_>, target: &mut [f64]) {
    dispatch(ExtendAdd { schur, ld, place, target });
}

#[inline(always)]
fn run<V: Four>(schur: &[f64], ld: usize, place: PanelRuns<'_>, target: &mut [f64]) {
    for (k, column) in place.runs[..place.columns].iter().enumerate() {
        let (from, to) = (column.child as usize, column.parent as usize - place.shift);
        let (source, target) = (&schur[from * ld..], &mut target[to * place.ld..]);
        let columns = column.len as usize;
        for j in 0..columns {
            // From an even row on: whole pairs, and one scratch row at most.
            let above = j & !1;
            let rows = columns - above;
            let source = &source[j * ld + from + above..][..rows];
            add::<V>(&mut target[j * place.ld + to + above..][..rows], source);
        }
        for rows in &place.runs[k + 1..] {
            let (from, to) = (rows.child as usize, rows.parent as usize - place.shift);
            let (source, target) = (&source[from..], &mut target[to..]);
            match rows.len {
                6 => add_poses::<V, 1>(columns, (source, ld), (target, place.ld)),
                12 => add_poses::<V, 2>(columns, (source, ld), (target, place.ld)),
                18 => add_poses::<V, 3>(columns, (source, ld), (target, place.ld)),
                len => {
                    for j in 0..columns {
                        let source = &source[j * ld..][..len as usize];
                        add::<V>(&mut target[j * place.ld..][..len as usize], source);
                    }
                }
            }
        }
    }
}

/// Adds a rectangle with the rows of N poses, given by its first scalar and leading dimension.
#[inline(always)]
fn add_poses<V: Four, const N: usize>(
    columns: usize,
    (mut source, ld): (&[f64], usize),
    (mut target, target_ld): (&mut [f64], usize),
) {
    for _ in 0..columns {
        let (Some(s), Some(t)) = (
            source.as_chunks::<6>().0.first_chunk::<N>(),
            target.as_chunks_mut::<6>().0.first_chunk_mut::<N>(),
        ) else {
            return;
        };
        for (t, s) in t.iter_mut().zip(s) {
            let sum = V::new([t[0], t[1], t[2], t[3]]).add(V::new([s[0], s[1], s[2], s[3]]));
            [t[0], t[1], t[2], t[3]] = sum.get();
            (t[4], t[5]) = (t[4] + s[4], t[5] + s[5]);
        }
        (source, target) = (source.get(ld..).unwrap_or(&[]), target.get_mut(target_ld..).unwrap_or(&mut []));
    }
}

/// `target += source`.
#[inline(always)]
fn add<V: Four>(target: &mut [f64], source: &[f64]) {
    let ((t4, t), (s4, s)) = (target.as_chunks_mut::<4>(), source.as_chunks::<4>());
    for (t, s) in t4.iter_mut().zip(s4) {
        *t = V::new(*t).add(V::new(*s)).get();
    }
    let ((t2, t), (s2, s)) = (t.as_chunks_mut::<2>(), s.as_chunks::<2>());
    if let ([t], [s]) = (t2, s2) {
        (t[0], t[1]) = (t[0] + s[0], t[1] + s[1]);
    }
    if let ([t], [s]) = (t, s) {
        *t += s;
    }
}
