//! An index of landmarks by parts of their descriptors (locality-sensitive hashing by sampled bits, Indyk & Motwani 1998; Gionis et al. 1999).

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::features::Descriptor;
use crate::options::SearchOptions;

/// No entry, and no block.
const NONE: u32 = u32::MAX;
/// Seed of the choice of bits.
const SEED: u64 = 0x0069_6e64_6578;
/// Entries of a block.
const BLOCK: usize = 7;

/// Entries with the same key; together in memory, so that a look at all of them does not wait for each.
#[derive(Clone, Copy, Debug)]
struct Block {
    entries: [u32; BLOCK],
    /// The block before, full, with the same key.
    before: u32,
}

/// The blocks of a key.
#[derive(Clone, Copy, Debug)]
struct Chain {
    newest: u32,
    length: u32,
}

/// Landmarks of keyframes, found by parts of their descriptors. 36 bytes and about 5 a table for each landmark.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    options: SearchOptions,
    /// Bits of the key of each table; no two tables share one.
    bits: Vec<Vec<usize>>,
    chains: Vec<Vec<Chain>>,
    /// Descriptor of each entry.
    descriptors: Vec<Descriptor>,
    /// Keyframe of each entry, apart from the descriptors: most entries are passed over by it.
    keyframe_of: Vec<u32>,
    blocks: Vec<Block>,
    /// Blocks of keys that became too common.
    free: Vec<u32>,
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
        Self {
            options,
            bits,
            chains,
            descriptors: Vec::new(),
            keyframe_of: Vec::new(),
            blocks: Vec::new(),
            free: Vec::new(),
            keyframes: 0,
        }
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
            let entry = self.descriptors.len() as u32;
            self.descriptors.push(descriptor);
            self.keyframe_of.push(keyframe);
            for table in 0..self.bits.len() {
                self.link(table, key(&descriptor, &self.bits[table]), entry);
            }
        }
    }

    /// Adds an entry to a key. A key that became too common says nothing of a place any more: its blocks are given back.
    fn link(&mut self, table: usize, key: usize, entry: u32) {
        let Chain { newest, length } = self.chains[table][key];
        let most = self.options.most_alike as u32;
        let mut at = newest;
        if length >= most {
            while let Some(block) = self.blocks.get(at as usize) {
                self.free.push(at);
                at = block.before;
            }
            self.chains[table][key] = Chain { newest: NONE, length: most.saturating_add(1) };
            return;
        }
        let within = length as usize % BLOCK;
        if within == 0 {
            let block = Block { entries: [NONE; BLOCK], before: newest };
            at = self.free.pop().unwrap_or(self.blocks.len() as u32);
            match self.blocks.get_mut(at as usize) {
                Some(reused) => *reused = block,
                None => self.blocks.push(block),
            }
        }
        if let Some(block) = self.blocks.get_mut(at as usize) {
            block.entries[within] = entry;
        }
        self.chains[table][key] = Chain { newest: at, length: length + 1 };
    }

    /// Entries with a key, the newest block first; none of a key that is too common.
    fn alike(&self, table: usize, key: usize) -> impl Iterator<Item = (u32, &Descriptor)> {
        let mut at = self.chains[table][key].newest;
        let next = move || {
            let block = self.blocks.get(at as usize)?;
            at = block.before;
            Some(&block.entries)
        };
        // Places of the newest block that are not taken hold no entry.
        let entry = |k: &u32| Some((*self.keyframe_of.get(*k as usize)?, self.descriptors.get(*k as usize)?));
        std::iter::from_fn(next).flatten().filter_map(entry)
    }

    /// Scores of all keyframes for these descriptors. Each descriptor shares a vote of at most 1 among the keyframes that hold one like it,
    /// by the logarithm of their rarity.
    pub(crate) fn scores(&self, descriptors: impl IntoIterator<Item = Descriptor>) -> Vec<f32> {
        let mut scores = vec![0.0_f32; self.keyframes];
        // The descriptor that voted last for a keyframe.
        let mut last = vec![NONE; self.keyframes];
        let whole = (1.0 + self.keyframes as f32).ln();
        let mut voted: Vec<u32> = Vec::new();
        for (k, descriptor) in descriptors.into_iter().enumerate() {
            voted.clear();
            for (table, bits) in self.bits.iter().enumerate() {
                for (keyframe, own) in self.alike(table, key(&descriptor, bits)) {
                    let last = &mut last[keyframe as usize];
                    if *last != k as u32 && own.distance(&descriptor) <= self.options.most_distance {
                        *last = k as u32;
                        voted.push(keyframe);
                    }
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

    #[test]
    fn a_key_that_became_too_common_is_given_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (common, rare) = (random(&mut rng), random(&mut rng));
        let options = SearchOptions { most_alike: 20, ..SearchOptions::default() };
        let mut index = Index::new(options);
        (0..20).for_each(|_| index.push([]));
        (0..20).for_each(|_| index.push([common]));
        assert!(index.scores([common])[20..].iter().all(|s| *s > 0.1));
        index.push([common]);
        assert_eq!(index.scores([common]), vec![0.0; 41]);
        let blocks = index.blocks.len();
        // A place of its own takes the blocks again, one a table.
        (0..3).for_each(|_| index.push([rare]));
        assert!(index.scores([rare])[41..].iter().all(|s| *s > 0.3));
        assert_eq!((index.blocks.len(), index.free.len()), (blocks, blocks - options.tables));
    }
}
