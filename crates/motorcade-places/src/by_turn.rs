//! Features in order of their orientation, so that those of about the same one are found without looking at all.

use crate::features::{Descriptor, Feature};

/// Number of orientations.
const TURNS: usize = 256;

/// Features in order of their orientation.
pub(crate) struct ByTurn {
    /// Index, level and descriptor of each.
    features: Vec<(usize, u8, Descriptor)>,
    /// Place of the first feature of each orientation, and the end.
    starts: [usize; TURNS + 1],
}

impl ByTurn {
    pub(crate) fn new(features: &[Feature]) -> Self {
        let mut order: Vec<usize> = (0..features.len()).collect();
        order.sort_by_key(|k| (features[*k].turn, *k));
        let mut starts = [0; TURNS + 1];
        for feature in features {
            starts[usize::from(feature.turn) + 1] += 1;
        }
        for turn in 0..TURNS {
            starts[turn + 1] += starts[turn];
        }
        let entry = |k: usize| (k, features[k].level, features[k].descriptor);
        Self { features: order.into_iter().map(entry).collect(), starts }
    }

    /// Index, level and descriptor of the features whose orientation differs by at most `most` 256ths of a turn.
    pub(crate) fn around(
        &self,
        turn: u8,
        most: u8,
    ) -> impl Iterator<Item = (usize, u8, Descriptor)> + use<'_> {
        let (turn, most) = (usize::from(turn), usize::from(most));
        let (low, high) = (turn as i64 - most as i64, (turn + most) as i64);
        let whole = TURNS as i64;
        // The three parts of the circle in which the interval may lie.
        let part = move |from: i64| {
            let first = (low - from).clamp(0, whole) as usize;
            let end = (high - from + 1).clamp(0, whole) as usize;
            &self.features[self.starts[first]..self.starts[end.max(first)]]
        };
        let all = 2 * most + 1 >= TURNS;
        let parts = if all { [&self.features[..], &[], &[]] } else { [-whole, 0, whole].map(part) };
        parts.into_iter().flatten().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_around_an_orientation_are_those_that_a_look_at_all_finds() {
        let at = |turn: u8| Feature {
            descriptor: Descriptor([u64::from(turn); 4]),
            pixel: [0.0; 2],
            level: 1,
            turn,
        };
        let features: Vec<Feature> = (0..300).map(|k| at((k * 97 % 256) as u8)).collect();
        let by_turn = ByTurn::new(&features);
        for (turn, most) in [(0, 20), (3, 20), (250, 20), (128, 0), (77, 127), (9, 128), (9, 255)] {
            let mut found: Vec<usize> = by_turn.around(turn, most).map(|(k, _, _)| k).collect();
            found.sort_unstable();
            let near = |k: &usize| features[*k].turn_to(&at(turn)) <= most;
            assert_eq!(found, (0..300).filter(near).collect::<Vec<usize>>(), "{turn} {most}");
        }
    }
}
