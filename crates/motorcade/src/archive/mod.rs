//! Records of a drive of any length in a temporary file, up to its end.

mod records;
mod stored;

use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom, Write};

pub(crate) use stored::Stored;

/// Records that only the end of a drive needs, in order. They lie in a temporary file without a name, which the system removes with the process;
/// where none can be written they stay in memory.
#[derive(Debug)]
pub(crate) struct Archive<T> {
    /// None before the first record, and where no file can be made.
    file: Option<File>,
    /// Records in the file.
    count: usize,
    /// The records after those in the file, once it could not be written.
    kept: Vec<T>,
    failed: bool,
}

impl<T> Default for Archive<T> {
    fn default() -> Self {
        Self { file: None, count: 0, kept: Vec::new(), failed: false }
    }
}

impl<T: Stored> Archive<T> {
    /// Records so far.
    pub(crate) fn len(&self) -> usize {
        self.count + self.kept.len()
    }

    /// Adds records. Many at once cost less than one by one.
    pub(crate) fn put_away(&mut self, records: Vec<T>) {
        if records.is_empty() {
            return;
        }
        if !self.failed && self.write(&records) {
            self.count += records.len();
        } else {
            // The file stays readable up to here.
            self.failed = true;
            self.kept.extend(records);
        }
    }

    /// False where the file cannot be made or written.
    fn write(&mut self, records: &[T]) -> bool {
        if self.file.is_none() {
            self.file = tempfile::tempfile().ok();
        }
        let Some(file) = &mut self.file else { return false };
        let mut bytes = Vec::new();
        records.iter().for_each(|record| record.write(&mut bytes));
        file.write_all(&bytes).is_ok()
    }

    /// Takes all records out, oldest first.
    ///
    /// # Errors
    /// A file that does not read back; all records are lost then.
    pub(crate) fn take_back(&mut self) -> io::Result<Vec<T>> {
        let Self { file, count, kept, failed } = std::mem::take(self);
        self.failed = failed;
        let Some(mut file) = file else { return Ok(kept) };
        file.seek(SeekFrom::Start(0))?;
        let mut reader = BufReader::new(file);
        let mut records = Vec::with_capacity(count + kept.len());
        for _ in 0..count {
            records.push(T::read(&mut reader)?);
        }
        records.extend(kept);
        Ok(records)
    }

    /// An archive that cannot be written, as on a full disk.
    #[cfg(test)]
    pub(crate) fn unwritable() -> Self {
        Self { failed: true, ..Self::default() }
    }

    /// Makes the file one that cannot be read or written any more, as of a disk that broke.
    #[cfg(test)]
    pub(crate) fn break_file(&mut self) {
        self.file = File::open("/").ok();
    }
}

#[cfg(test)]
mod tests;
