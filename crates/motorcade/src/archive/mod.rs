//! Records of a drive of any length in a temporary file, up to its end.

mod records;
mod stored;

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use motorcade_dataset::regular_file;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

pub(crate) use stored::{Stored, StoredList};

/// A warning about what a temporary file held that did not read back.
pub(crate) fn not_read_back(what: &str, error: &io::Error) -> String {
    format!(
        "lost: {what}; a temporary file did not read back ({error}); repeat the run, with TMPDIR on another disk"
    )
}

/// Records that only the end of a drive needs, in order. They lie in a temporary file without a name, which the system removes with the process,
/// or, of a run with a checkpoint, in a file that another process goes on with; where none can be written they stay in memory.
#[derive(Debug)]
pub(crate) struct Archive<T> {
    /// None before the first record, and where no file can be made.
    file: Option<File>,
    /// Records in the file.
    count: usize,
    /// The records after those in the file, once it could not be written.
    kept: Vec<T>,
    failed: bool,
    /// The file with a name; else it has none.
    named: Option<NamedFile>,
}

/// A file that only grows.
#[derive(Debug)]
struct NamedFile {
    path: PathBuf,
    bytes: u64,
    hash: Sha256,
}

/// Length and digest of a named file after some frame: it is cut to that when a run goes on.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ArchiveState {
    count: usize,
    bytes: u64,
    sha256: [u8; 32],
}

impl ArchiveState {
    /// Records.
    pub(crate) fn len(&self) -> usize {
        self.count
    }
}

impl<T> Default for Archive<T> {
    fn default() -> Self {
        Self { file: None, count: 0, kept: Vec::new(), failed: false, named: None }
    }
}

impl<T: Stored> Archive<T> {
    /// In the file of this name, made with the first record in place of any that is there.
    pub(crate) fn named(path: PathBuf) -> Self {
        Self { named: Some(NamedFile { path, bytes: 0, hash: Sha256::new() }), ..Self::default() }
    }

    /// The records so far, which are on the disk then.
    ///
    /// # Errors
    /// Records that could not be written, or not to a file with a name.
    pub(crate) fn state(&self) -> io::Result<ArchiveState> {
        let Self { file, count, kept, failed, named } = self;
        if *failed || !kept.is_empty() {
            return Err(io::Error::other("rows of the drive could not be written to a file"));
        }
        let Some(file) = file else { return Ok(ArchiveState::default()) };
        let Some(NamedFile { path: _, bytes, hash }) = named else {
            return Err(io::Error::other("rows of the drive lie in a file without a name"));
        };
        file.sync_data()?;
        Ok(ArchiveState { count: *count, bytes: *bytes, sha256: hash.clone().finalize().into() })
    }

    /// Goes on with the file of the name of this archive as it was in a state; what was added since is cut off.
    ///
    /// # Errors
    /// A file that is shorter or holds something else.
    pub(crate) fn resumed(&self, state: &ArchiveState) -> io::Result<Self> {
        let ArchiveState { count, bytes, sha256 } = state;
        let path = match &self.named {
            Some(named) => named.path.clone(),
            None if *count == 0 => return Ok(Self::default()),
            None => return Err(io::Error::other("rows of the drive lie in files that are not named here")),
        };
        if *count == 0 {
            return Ok(Self::named(path));
        }
        regular_file::not_a_link(&path)?;
        let mut file = OpenOptions::new().read(true).write(true).open(&path)?;
        let mut hash = Sha256::new();
        let read = io::copy(&mut (&mut file).take(*bytes), &mut hash)?;
        if read != *bytes || <[u8; 32]>::from(hash.clone().finalize()) != *sha256 {
            let problem = format!("{} is not as it was", path.display());
            return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
        }
        file.set_len(*bytes)?;
        file.seek(SeekFrom::Start(*bytes))?;
        let named = Some(NamedFile { path, bytes: *bytes, hash });
        Ok(Self { file: Some(file), count: *count, named, ..Self::default() })
    }

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
            self.file = match &self.named {
                Some(named) => named.create().ok(),
                None => tempfile::tempfile().ok(),
            };
        }
        let Some(file) = &mut self.file else { return false };
        let mut bytes = Vec::new();
        records.iter().for_each(|record| record.write(&mut bytes));
        let written = file.write_all(&bytes).is_ok();
        if let Some(named) = self.named.as_mut().filter(|_| written) {
            named.bytes += bytes.len() as u64;
            named.hash.update(&bytes);
        }
        written
    }

    /// Takes all records out, oldest first.
    ///
    /// # Errors
    /// A file that does not read back; all records are lost then.
    pub(crate) fn take_back(&mut self) -> io::Result<Vec<T>> {
        let Self { file, count, kept, failed, named } = std::mem::take(self);
        self.failed = failed;
        // Records that are put away from now on lie in a new file of that name.
        self.named = named.map(|named| NamedFile { path: named.path, bytes: 0, hash: Sha256::new() });
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

impl NamedFile {
    /// Makes the file, and its folder.
    fn create(&self) -> io::Result<File> {
        self.path.parent().map_or(Ok(()), fs::create_dir_all)?;
        match fs::remove_file(&self.path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
            _ => {}
        }
        OpenOptions::new().read(true).write(true).create_new(true).open(&self.path)
    }
}

#[cfg(test)]
mod tests;
