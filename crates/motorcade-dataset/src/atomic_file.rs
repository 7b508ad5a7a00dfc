//! Files that are written whole or not at all: beside their place, then renamed.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Writes a file beside its place and renames it, so that a reader never sees a part of it. An existing file is replaced.
///
/// # Errors
/// Those of the file system; an existing file then stays as it was.
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    let staged = staged_path(path)?;
    let written = fs::write(&staged, contents).and_then(|()| fs::rename(&staged, path));
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&staged);
    }
    written
}

/// The hidden name beside a file or folder under which it is written first: `.NAME.partial-PID`.
///
/// # Errors
/// A path without a file name.
pub fn staged_path(path: &Path) -> io::Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"));
    };
    let mut staged = OsString::from(".");
    staged.push(name);
    staged.push(format!(".partial-{}", std::process::id()));
    Ok(path.with_file_name(staged))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        let inside_a_file = path.join("b.txt");
        assert!(write(&inside_a_file, "three").is_err());
        assert!(write(Path::new("/"), "three").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
    }
}
