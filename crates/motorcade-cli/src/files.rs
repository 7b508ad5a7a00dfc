//! Single files a command writes.

use std::path::{Path, PathBuf};

use motorcade::output::io_error;
use motorcade_dataset::atomic_file::PendingFile;
use serde::Serializer;

use crate::interruption;

/// A file to be written. Made before long work, so that a place that cannot be written is reported at once.
#[derive(Debug)]
pub struct OutFile {
    path: PathBuf,
    file: PendingFile,
}

impl OutFile {
    /// Checks the place.
    pub fn create(path: &Path) -> Result<Self, motorcade::Error> {
        let file = PendingFile::create(path).map_err(|e| io_error(path, &e))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// The same for a file that may not be asked for.
    pub fn create_optional(path: Option<&Path>) -> Result<Option<Self>, motorcade::Error> {
        path.map(Self::create).transpose()
    }

    /// Writes the content and puts the file in its place.
    pub fn write(self, text: impl AsRef<[u8]>) -> Result<(), motorcade::Error> {
        interruption::held_up(|| self.file.write(text)).map_err(|e| io_error(&self.path, &e))
    }
}

/// Directory of the drive of a demo: `runs/demo` → `runs/demo-drive`.
pub fn demo_drive(out: &Path) -> PathBuf {
    // `.` has no name of its own.
    let out =
        if out.file_name().is_none() { out.canonicalize().unwrap_or_default() } else { out.to_path_buf() };
    let mut name = out.file_name().unwrap_or("demo".as_ref()).to_owned();
    name.push("-drive");
    out.with_file_name(name)
}

/// A path in JSON; bytes that are no UTF-8 are replaced.
pub fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
