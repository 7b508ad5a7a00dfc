//! Extend-add: a child's Schur complement added to its parent's front.

use super::symbolic::Run;
use crate::simd::Four;

/// Where the runs of a child lie in its parent: in the panel, or in the Schur complement, which begins `shift` rows and
/// columns later.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<'a> {
    /// Runs of rows from the first column on.
    pub runs: &'a [Run],
    /// How many of them are columns here as well.
    pub columns: usize,
    pub shift: usize,
    /// Leading dimension of the parent's part.
    pub ld: usize,
}

/// Adds the lower triangle of the columns of `schur` (leading dimension `ld`) to `target`, whose upper triangle is scratch.
#[inline(always)]
pub(crate) fn extend_add<V: Four>(schur: &[f64], ld: usize, place: Place<'_>, target: &mut [f64]) {
    let shift = place.shift;
    for (k, run) in place.runs[..place.columns].iter().enumerate() {
        for j in 0..run.len as usize {
            let (from, to) = (run.child as usize, run.parent as usize - shift);
            let source = &schur[(from + j) * ld..(from + j + 1) * ld];
            let target = &mut target[(to + j) * place.ld..(to + j + 1) * place.ld];
            // From an even row on: whole pairs, and one scratch row at most.
            let (above, len) = (j & !1, run.len as usize);
            add::<V>(&mut target[to + above..to + len], &source[from + above..from + len]);
            for run in &place.runs[k + 1..] {
                let (from, to, len) = (run.child as usize, run.parent as usize - shift, run.len as usize);
                add::<V>(&mut target[to..to + len], &source[from..from + len]);
            }
        }
    }
}

/// `target += source`, for short stretches of an even length most of the time.
#[inline(always)]
fn add<V: Four>(target: &mut [f64], source: &[f64]) {
    let ((t4, t), (s4, s)) = (target.as_chunks_mut::<4>(), source.as_chunks::<4>());
    for (t, s) in t4.iter_mut().zip(s4) {
        *t = V::new(*t).add(V::new(*s)).get();
    }
    let ((t2, t), (s2, s)) = (t.as_chunks_mut::<2>(), s.as_chunks::<2>());
    if let ([t], [s]) = (t2, s2) {
        for i in 0..2 {
            t[i] += s[i];
        }
    }
    if let ([t], [s]) = (t, s) {
        *t += s;
    }
}
