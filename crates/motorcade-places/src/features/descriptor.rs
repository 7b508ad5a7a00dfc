//! Binary descriptors.

/// 256 binary tests of a patch, compared by Hamming distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Descriptor(pub [u64; 4]);

impl Descriptor {
    /// Number of tests.
    pub const BITS: usize = 256;

    /// Number of tests that differ.
    #[inline]
    pub fn distance(&self, other: &Self) -> u32 {
        let [a, b] = [&self.0, &other.0];
        (0..4).map(|k| (a[k] ^ b[k]).count_ones()).sum()
    }

    /// The outcome of a test.
    #[inline]
    pub(crate) fn bit(&self, k: usize) -> bool {
        (self.0[(k / 64) % 4] >> (k % 64)) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_counts_differing_bits() {
        let a = Descriptor([0b1011, 0, 0, 1 << 63]);
        let b = Descriptor([0b0001, 1, 0, 0]);
        assert_eq!((a.distance(&b), a.distance(&a)), (4, 0));
        assert!(a.bit(0) && !a.bit(2) && a.bit(255) && b.bit(64));
    }
}
