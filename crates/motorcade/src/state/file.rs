//! The file of a state: magic, version and SHA-256 of the content, then the content: length and name of the run, the parts, the end of each
//! part within the content, and how many there are. Numbers are little-endian.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use sha2::{Digest, Sha256};

/// First bytes of the file.
const MAGIC: &[u8; 16] = b"motorcade state\n";
/// Version of the format; to be raised whenever a field of any state changes.
const VERSION: u32 = 7;
/// Place of the digest.
const DIGEST: usize = MAGIC.len() + 4;
/// Length of what stands before the content.
pub(super) const HEADER: usize = DIGEST + 32;

/// Writes the parts of a state without holding them.
pub struct StateWriter {
    file: BufWriter<File>,
    digest: Sha256,
    /// Bytes of content so far.
    written: u64,
    /// End of each part in the content.
    ends: Vec<u64>,
    /// The first error of the file: serialisers do not pass it on.
    problem: Option<io::Error>,
}

impl StateWriter {
    pub(super) fn new(file: File, run: &str) -> io::Result<Self> {
        let mut file = BufWriter::new(file);
        file.write_all(MAGIC)?;
        file.write_all(&VERSION.to_le_bytes())?;
        // The digest is known at the end.
        file.write_all(&[0; 32])?;
        let mut out = Self { file, digest: Sha256::new(), written: 0, ends: Vec::new(), problem: None };
        let length = u32::try_from(run.len()).map_err(io::Error::other)?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(run.as_bytes())?;
        Ok(out)
    }

    /// Ends a part: what is written from here on is the next one.
    pub fn end_part(&mut self) {
        self.ends.push(self.written);
    }

    /// Ends the file and has it on the disk; returns its length in bytes.
    pub(super) fn finish(mut self) -> io::Result<u64> {
        let ends = std::mem::take(&mut self.ends);
        for number in ends.iter().copied().chain([ends.len() as u64]) {
            self.write_all(&number.to_le_bytes())?;
        }
        if let Some(problem) = self.problem {
            return Err(problem);
        }
        self.file.seek(SeekFrom::Start(DIGEST as u64))?;
        self.file.write_all(&self.digest.finalize())?;
        self.file.flush()?;
        self.file.get_ref().sync_all()?;
        Ok(HEADER as u64 + self.written)
    }
}

impl Write for StateWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes).inspect_err(|e| {
            let same = || io::Error::new(e.kind(), e.to_string());
            self.problem.get_or_insert_with(same);
        })?;
        self.digest.update(&bytes[..count]);
        self.written += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// The parts of a file of this run.
pub(super) fn parts(bytes: &[u8], run: &str) -> io::Result<Vec<Vec<u8>>> {
    let refused = |why: &str| io::Error::new(io::ErrorKind::InvalidData, why.to_owned());
    let known = bytes.split_at_checked(HEADER).filter(|(header, _)| header.starts_with(MAGIC));
    let Some((header, content)) = known else { return Err(refused("it is none")) };
    let (version, digest) = header[MAGIC.len()..].split_at(4);
    if version != VERSION.to_le_bytes() {
        return Err(refused("it is of another version of the program"));
    }
    if digest != Sha256::digest(content).as_slice() {
        return Err(refused("it is damaged"));
    }
    let (own, parts) = split(content).ok_or_else(|| refused("it is damaged"))?;
    if own != run.as_bytes() {
        return Err(refused("it is one of another run or of another build of the program"));
    }
    Ok(parts)
}

/// Name of the run and parts of a content.
fn split(content: &[u8]) -> Option<(&[u8], Vec<Vec<u8>>)> {
    let (length, rest) = content.split_first_chunk::<4>()?;
    let (run, _) = rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    let number = |at: usize| -> Option<usize> {
        let bytes = content.get(at..at.checked_add(8)?)?.try_into().ok()?;
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    };
    let counted = content.len().checked_sub(8)?;
    let ends = counted.checked_sub(number(counted)?.checked_mul(8)?)?;
    let mut begin = length.len() + run.len();
    let mut parts = Vec::new();
    for at in (ends..counted).step_by(8) {
        let end = number(at)?;
        parts.push(content.get(begin..end).filter(|_| end <= ends)?.to_vec());
        begin = end;
    }
    Some((run, parts))
}
