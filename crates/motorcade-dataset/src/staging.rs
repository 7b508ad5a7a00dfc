//! Temporary names beside results, each locked by the process that writes it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

/// Start of every temporary name; six random letters and digits follow.
pub const PREFIX: &str = ".motorcade-partial-";

/// True for the name of a temporary file or directory of this program.
pub fn is_staging_name(name: &std::ffi::OsStr) -> bool {
    let random = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
    random.is_some_and(|r| r.len() == 6 && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Locks an open file or directory. False when another process holds it; a file system without locks counts as free.
pub fn try_lock(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Makes a temporary file or directory in `folder` and locks it. The lock ends with the process, however it ends.
///
/// # Errors
/// Those of the file system.
pub fn create<T>(
    folder: &Path,
    make: impl Fn(&mut tempfile::Builder<'_, '_>, &Path) -> io::Result<T>,
    path: impl Fn(&T) -> &Path,
) -> io::Result<(T, Option<File>)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    loop {
        let made = make(&mut builder, folder)?;
        // Systems that do not open directories go without a lock.
        let lock = File::open(path(&made)).ok().filter(try_lock);
        // Another process may have removed it as stale before it was locked.
        if path(&made).exists() {
            return Ok((made, lock));
        }
    }
}

/// Removes temporary files and directories in `folder` that no process holds any more. `keep` spares a directory.
pub fn remove_stale(folder: &Path, keep: impl Fn(&Path) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let kind = entry.file_type();
        if !is_staging_name(&entry.file_name()) || !kind.is_ok_and(|k| k.is_file() || k.is_dir()) {
            continue;
        }
        // A lock that cannot be had or tried is somebody's.
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) && !keep(&path) {
            // Best effort: what stays does no harm.
            let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}
