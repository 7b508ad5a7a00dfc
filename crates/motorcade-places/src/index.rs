//! An index of landmarks by parts of their descriptors (locality-sensitive hashing by sampled bits, Indyk & Motwani 1998; Gionis et al. 1999).

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::features::Descriptor;
use crate::options::SearchOptions;

/// No entry.
const NONE: u32 = u32::MAX;
/// Seed of the choice of bits.
const SEED: u64 = 0x0069_6e64_6578;

/// A landmark of the index.
#[derive(Clone, Copy, Debug)]
struct Entry {
    descriptor: Descriptor,
    keyframe: u32,
}

/// Chains of entries with the same key.
#[derive(Clone, Copy, Debug)]
struct Chain {
    newest: u32,
    length: u32,
}

/// Landmarks of keyframes, found by parts of their descriptors. 36 bytes and 4 a table for each landmark.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    options: SearchOptions,
    /// Bits of the key of each table; no two tables share one.
    bits: Vec<Vec<usize>>,
    chains: Vec<Vec<Chain>>,
    entries: Vec<Entry>,
    /// The entry before, with the same key, `tables` a landmark.
    before: Vec<u32>,
    keyframes: usize,
}

impl Index {
    pub(crate) fn new(options: SearchOptions) -> Self {
        let mut all: Vec<usize> = (0..Descriptor::BITS).collect();
        all.shuffle(&mut ChaCha8Rng::seed_from_u64(SEED));
        let bits: Vec<Vec<usize>> =
            all.chunks(options.key_bits.max(1)).take(options.tables).map(<[usize]>::to_vec).collect();
        let empty = vec![Chain { newest: NONE, length: 0 }; 1 << options.key_bits];
        let chains = vec![empty; bits.len()];
        Self { options, bits, chains, entries: Vec::new(), before: Vec::new(), keyframes: 0 }
    }

    /// Keyframes in it, numbered from 0 in the order they came.
    pub(crate) fn len(&self) -> usize {
        self.keyframes
    }

    /// Adds the next keyframe.
    pub(crate) fn push(&mut self, descriptors: impl IntoIterator<Item = Descriptor>) {
        let keyframe = self.keyframes as u32;
        self.keyframes += 1;
        for descriptor in descriptors {
            let entry = self.entries.len() as u32;
            self.entries.push(Entry { descriptor, keyframe });
            for (bits, chains) in self.bits.iter().zip(&mut self.chains) {
                let chain = &mut chains[key(&descriptor, bits)];
                self.before.push(chain.newest);
                *chain = Chain { newest: entry, length: chain.length + 1 };
            }
        }
    }

    /// Scores of all keyframes for these descriptors. Each descriptor shares a vote of at most 1 among the keyframes that hold one like it,
    /// by the logarithm of their rarity.
    pub(crate) fn scores(&self, descriptors: impl IntoIterator<Item = Descriptor>) -> Vec<f32> {
        let mut scores = vec![0.0_f32; self.keyframes];
        // The descriptor that voted last for a keyframe.
        let mut last = vec![NONE; self.keyframes];
        let tables = self.bits.len();
        let whole = (1.0 + self.keyframes as f32).ln();
        let mut voted: Vec<u32> = Vec::new();
        for (k, descriptor) in descriptors.into_iter().enumerate() {
            voted.clear();
            for (table, (bits, chains)) in self.bits.iter().zip(&self.chains).enumerate() {
                let chain = chains[key(&descriptor, bits)];
                if chain.length as usize > self.options.most_alike {
                    continue;
                }
                let mut at = chain.newest;
                while let Some(entry) = self.entries.get(at as usize) {
                    let keyframe = entry.keyframe as usize;
                    if last[keyframe] != k as u32
                        && entry.descriptor.distance(&descriptor) <= self.options.most_distance
                    {
                        last[keyframe] = k as u32;
                        voted.push(entry.keyframe);
                    }
                    at = self.before[at as usize * tables + table];
                }
            }
            let rarity = (whole - (1.0 + voted.len() as f32).ln()).max(0.0) / whole.max(1e-6);
            for keyframe in &voted {
                scores[*keyframe as usize] += rarity;
            }
        }
        scores
    }
}

fn key(descriptor: &Descriptor, bits: &[usize]) -> usize {
    bits.iter().fold(0, |key, bit| (key << 1) | usize::from(descriptor.bit(*bit)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    fn random(rng: &mut ChaCha8Rng) -> Descriptor {
        Descriptor(std::array::from_fn(|_| rng.random()))
    }

    /// The descriptor with `count` of its bits changed.
    fn changed(descriptor: &Descriptor, count: usize, rng: &mut ChaCha8Rng) -> Descriptor {
        let mut out = *descriptor;
        for _ in 0..count {
            let bit = rng.random_range(0..256);
            out.0[bit / 64] ^= 1 << (bit % 64);
        }
        out
    }

    #[test]
    fn the_keyframe_seen_again_scores_highest() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let keyframes: Vec<Vec<Descriptor>> =
            (0..300).map(|_| (0..100).map(|_| random(&mut rng)).collect()).collect();
        let mut index = Index::new(SearchOptions::default());
        keyframes.iter().for_each(|k| index.push(k.iter().copied()));
        // A third of the landmarks is seen again, with 30 of 256 bits changed.
        let query: Vec<Descriptor> = (0..100)
            .map(|i| if i % 3 == 0 { changed(&keyframes[123][i], 30, &mut rng) } else { random(&mut rng) })
            .collect();
        let scores = index.scores(query);
        let best = (0..300).max_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap();
        assert_eq!(best, 123);
        let second = scores.iter().enumerate().filter(|(k, _)| *k != 123).map(|s| *s.1).fold(0.0, f32::max);
        assert!(scores[123] > 10.0 && second < 2.0, "{} {second}", scores[123]);
    }

    #[test]
    fn what_stands_everywhere_says_nothing() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let common = random(&mut rng);
        let mut index = Index::new(SearchOptions::default());
        for _ in 0..200 {
            index.push([common]);
        }
        assert!(index.scores([common]).iter().all(|s| *s < 0.01));
        assert_eq!(index.len(), 200);
    }
}
