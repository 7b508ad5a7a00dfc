//! Large arrays of numbers.
//!
//! Fresh memory costs a page fault for every 4 KiB and, when it is walked, a place in the translation buffer for each.
//! On Linux, arrays of several MiB are therefore mapped with the advice to use huge pages (2 MiB), which the kernel
//! follows in its settings `madvise` (the usual one) and `always`. On a virtual machine, where a fault took 2.5 µs, that was
//! a sixth of the time of a short solve.

use std::ops::{Deref, DerefMut};

/// Bytes of a huge page.
#[cfg(target_os = "linux")]
const HUGE: usize = 2 << 20;

/// An array of numbers of fixed length that starts at zero.
#[derive(Debug, Default)]
pub(crate) struct Numbers(Memory);

#[derive(Debug)]
enum Memory {
    Heap(Vec<f64>),
    /// Length in numbers, and the pages, which may be more.
    #[cfg(target_os = "linux")]
    Pages(usize, memmap2::MmapMut),
}

impl Default for Memory {
    fn default() -> Self {
        Self::Heap(Vec::new())
    }
}

impl Numbers {
    /// `len` zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        Self(pages(len).unwrap_or_else(|| Memory::Heap(vec![0.0; len])))
    }
}

/// Zeros on huge pages; none where that is not worth it or not to be had.
#[cfg(target_os = "linux")]
fn pages(len: usize) -> Option<Memory> {
    let bytes = len.checked_mul(size_of::<f64>()).filter(|&b| b >= HUGE)?;
    // Whole pages: the last one costs less than the small ones in its place.
    let map = memmap2::MmapMut::map_anon(bytes.checked_next_multiple_of(HUGE)?).ok()?;
    // Advice only: a kernel without huge pages serves small ones.
    let _refused = map.advise(memmap2::Advice::HugePage);
    Some(Memory::Pages(len, map))
}

#[cfg(not(target_os = "linux"))]
fn pages(_: usize) -> Option<Memory> {
    None
}

impl Deref for Numbers {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        match &self.0 {
            Memory::Heap(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Memory::Pages(len, map) => &bytemuck::cast_slice(map)[..*len],
        }
    }
}

impl DerefMut for Numbers {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        match &mut self.0 {
            Memory::Heap(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Memory::Pages(len, map) => &mut bytemuck::cast_slice_mut(map)[..*len],
        }
    }
}

impl Clone for Numbers {
    fn clone(&self) -> Self {
        let mut copy = Self::zeros(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_any_length_are_zero_writable_and_copied() {
        for len in [0, 1, 1000, (2 << 20) / 8 - 1, (2 << 20) / 8, 700_001] {
            let mut numbers = Numbers::zeros(len);
            assert!(numbers.len() == len && numbers.iter().all(|&x| x == 0.0));
            for (k, x) in numbers.iter_mut().enumerate() {
                *x = k as f64;
            }
            let copy = numbers.clone();
            numbers.fill(-1.0);
            assert!(copy.iter().enumerate().all(|(k, &x)| x == k as f64) && copy.len() == len);
        }
    }
}
