//! Places of blocks.

/// Place of a block in a `BlockMatrix`.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// First scalar of the block (enough for 32 GiB).
    pub(crate) offset: u32,
    /// True when the stored block is (second, first) of the pair asked for.
    pub(crate) transposed: bool,
    /// True for the first share of a block: it is written, not added, so that nothing has to be cleared.
    pub(crate) first: bool,
}
