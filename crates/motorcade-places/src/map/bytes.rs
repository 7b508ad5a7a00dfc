//! Little-endian numbers and the checksum of a file.

use super::error::MapError;

/// FNV-1a, 64 bits.
pub(super) fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, b| (hash ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// Rows and columns of the upper triangle of a 6×6 matrix, in the order of the file.
pub(super) fn upper_triangle() -> impl Iterator<Item = (usize, usize)> {
    (0..6).flat_map(|row| (row..6).map(move |column| (row, column)))
}

/// Reads from a slice, front to back.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], MapError> {
        let ends = || MapError::Damaged("it ends early".into());
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or_else(ends)?;
        self.0 = rest;
        Ok(*head)
    }
    pub(super) fn u8(&mut self) -> Result<u8, MapError> {
        self.array::<1>().map(|[b]| b)
    }
    pub(super) fn u32(&mut self) -> Result<u32, MapError> {
        self.array().map(u32::from_le_bytes)
    }
    pub(super) fn u64(&mut self) -> Result<u64, MapError> {
        self.array().map(u64::from_le_bytes)
    }
    /// A finite number of at most a thousand kilometres.
    pub(super) fn f64(&mut self) -> Result<f64, MapError> {
        let value = self.array().map(f64::from_le_bytes)?;
        if value.abs() <= 1e6 { Ok(value) } else { Err(MapError::Damaged(format!("a number is {value}"))) }
    }
    /// The same.
    pub(super) fn f32(&mut self) -> Result<f32, MapError> {
        let value = self.array().map(f32::from_le_bytes)?;
        if value.abs() <= 1e6 { Ok(value) } else { Err(MapError::Damaged(format!("a number is {value}"))) }
    }
    /// A count of things of so many bytes each, no more than the rest of the file holds.
    pub(super) fn count(&mut self, bytes_each: usize) -> Result<usize, MapError> {
        let count = self.u32()? as usize;
        if count <= self.0.len() / bytes_each.max(1) {
            Ok(count)
        } else {
            Err(MapError::Damaged(format!("{count} entries do not fit into its {} bytes", self.0.len())))
        }
    }
}
