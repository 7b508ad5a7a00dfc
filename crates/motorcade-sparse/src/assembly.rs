//! The share of two blocks of six scalars, such as a factor between two poses, added to the normal equations.

use crate::simd::{Four, Kernel, dispatch};
use crate::slot::Slot;

/// Leading dimension of H of two blocks.
const LD: usize = 12;

/// Places of the shares of two blocks of six scalars.
#[derive(Clone, Copy, Debug)]
pub struct PairSlots {
    /// Blocks (0, 0), (1, 0) and (1, 1); `None` for a block that is not in the matrix.
    pub blocks: [Option<Slot>; 3],
    /// First scalars in the right-hand side.
    pub rhs: [Option<usize>; 2],
}

struct AddPair<'a> {
    matrix: &'a mut [f64],
    rhs: &'a mut [f64],
    share: (&'a [f64; 12], &'a [f64; 144]),
    weight: f64,
    slots: &'a PairSlots,
}

impl Kernel for AddPair<'_> {
    type Output = ();
    #[inline(always)]
    fn run<V: Four>(self) {
        run::<V>(self.matrix, self.rhs, self.share, self.weight, self.slots);
    }
}

/// Adds `weight` times g (12) and the lower blocks of H (12×12) to the right-hand side, negated, and the matrix.
///
/// Columns are read as they were written, four rows and two: other loads would wait for the stores to reach the cache.
pub(crate) fn add_pair(
    matrix: &mut [f64],
    rhs: &mut [f64],
    share: (&[f64; 12], &[f64; 144]),
    weight: f64,
    slots: &PairSlots,
) {
    dispatch(AddPair { matrix, rhs, share, weight, slots });
}

#[inline(always)]
fn run<V: Four>(
    matrix: &mut [f64],
    rhs: &mut [f64],
    (g, h): (&[f64; 12], &[f64; 144]),
    weight: f64,
    slots: &PairSlots,
) {
    for (slot, corner) in slots.blocks.iter().zip([0, 6, 6 * LD + 6]) {
        if let Some(slot) = slot
            && let Some(block) = matrix.get_mut(slot.offset as usize..).and_then(|m| m.first_chunk_mut())
            && let Some(local) = h.get(corner..).and_then(|h| h.first_chunk())
        {
            match (slot.first, slot.transposed) {
                (false, false) => add_block::<V, false, false>(block, local, weight),
                (false, true) => add_block::<V, false, true>(block, local, weight),
                (true, false) => add_block::<V, true, false>(block, local, weight),
                (true, true) => add_block::<V, true, true>(block, local, weight),
            }
        }
    }
    for (start, g) in slots.rhs.iter().zip(g.as_chunks::<6>().0) {
        if let Some(rhs) = start.and_then(|s| rhs.get_mut(s..)).and_then(|r| r.first_chunk_mut()) {
            add_column::<V, false>(rhs, [g[0], g[1], g[2], g[3]], [g[4], g[5]], -weight);
        }
    }
}

/// A 6×6 block of 66 scalars with leading dimension 12; written where it is the first share, else added.
#[inline(always)]
fn add_block<V: Four, const FIRST: bool, const TRANSPOSED: bool>(
    block: &mut [f64; 36],
    local: &[f64; 66],
    weight: f64,
) {
    for (j, column) in block.as_chunks_mut::<6>().0.iter_mut().enumerate() {
        let at = |i: usize| local[if TRANSPOSED { LD * i + j } else { LD * j + i }];
        add_column::<V, FIRST>(column, [at(0), at(1), at(2), at(3)], [at(4), at(5)], weight);
    }
}

#[inline(always)]
fn add_column<V: Four, const FIRST: bool>(
    column: &mut [f64; 6],
    top: [f64; 4],
    bottom: [f64; 2],
    weight: f64,
) {
    let [a, b, c, d, e, f] = *column;
    let (top, bottom) = (V::new(top), [bottom[0] * weight, bottom[1] * weight]);
    if FIRST {
        [column[0], column[1], column[2], column[3]] = top.scale(weight).get();
        [column[4], column[5]] = bottom;
    } else {
        [column[0], column[1], column[2], column[3]] = top.scale_add(weight, V::new([a, b, c, d])).get();
        [column[4], column[5]] = [e + bottom[0], f + bottom[1]];
    }
}
