//! The pairs of pixels that are compared.

use std::sync::OnceLock;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::descriptor::Descriptor;

/// Half side of the patch \[px\]: no rotated test reaches beyond.
pub(super) const RADIUS_PX: i32 = 15;
/// Orientations the pattern is precomputed for: 256 / 8 = 32, 11° apart, as fine as orientations repeat.
const TURNS: usize = 32;
/// Seed of the pattern: descriptors of stored maps depend on it.
const SEED: u64 = 0x706c_6163_6573;

/// Offsets of a test \[px\]: x and y of the first pixel and of the second.
type Test = [i8; 4];

/// The tests at one orientation after another.
pub(super) struct Pattern {
    turned: Vec<[Test; Descriptor::BITS]>,
}

impl Pattern {
    /// The pattern of all descriptors: pairs with Gaussian coordinates of σ = R / 2.5 (BRIEF's best geometry has a fifth of the patch's
    /// side, Calonder et al., ECCV 2010, which is R / 2.5), those that almost coincide left out.
    pub(super) fn shared() -> &'static Self {
        static PATTERN: OnceLock<Pattern> = OnceLock::new();
        PATTERN.get_or_init(Self::new)
    }

    fn new() -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let radius = f64::from(RADIUS_PX);
        let mut coordinate = || {
            // The sum of twelve uniform numbers is Gaussian enough, and the same on every machine.
            let sum: f64 = (0..12).map(|_| rng.random_range(0.0..1.0)).sum();
            (sum - 6.0) * radius / 2.5
        };
        let mut pairs: Vec<[f64; 4]> = Vec::with_capacity(Descriptor::BITS);
        while pairs.len() < Descriptor::BITS {
            let pair: [f64; 4] = std::array::from_fn(|_| coordinate());
            // Within the circle, so that every rotation stays in the patch.
            let inside = |x: f64, y: f64| x.hypot(y) <= radius - 0.5;
            let apart = (pair[0] - pair[2]).hypot(pair[1] - pair[3]) >= 3.0;
            if apart && inside(pair[0], pair[1]) && inside(pair[2], pair[3]) {
                pairs.push(pair);
            }
        }
        let at = |k: usize| {
            let (sin, cos) = (k as f64 / TURNS as f64 * std::f64::consts::TAU).sin_cos();
            let turned =
                |x: f64, y: f64| [(cos * x - sin * y).round() as i8, (sin * x + cos * y).round() as i8];
            std::array::from_fn(|i| {
                let [ax, ay, bx, by] = pairs[i];
                let ([ax, ay], [bx, by]) = (turned(ax, ay), turned(bx, by));
                [ax, ay, bx, by]
            })
        };
        Self { turned: (0..TURNS).map(at).collect() }
    }

    /// The tests for an orientation in 256ths of a turn.
    pub(super) fn at(&self, turn: u8) -> &[Test; Descriptor::BITS] {
        let step = 256 / TURNS;
        &self.turned[((usize::from(turn) + step / 2) / step) % TURNS]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_tests_stay_in_the_patch_and_compare_different_pixels() {
        let pattern = Pattern::new();
        for turned in &pattern.turned {
            assert!(turned.iter().all(|t| (t[0], t[1]) != (t[2], t[3])));
            assert!(turned.iter().flatten().all(|c| i32::from(*c).abs() <= RADIUS_PX));
        }
    }

    #[test]
    fn a_quarter_turn_rotates_every_test() {
        let pattern = Pattern::new();
        for (a, b) in pattern.at(0).iter().zip(pattern.at(64)) {
            assert_eq!([-a[1], a[0], -a[3], a[2]], *b);
        }
    }
}
