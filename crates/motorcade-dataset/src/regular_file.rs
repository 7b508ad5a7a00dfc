//! Reading of input files: regular ones alone.

use std::fs::{self, File, FileType};
use std::io;
use std::path::Path;

/// Opens a regular file for reading. FIFOs, sockets and devices are refused, because they can block or never end.
///
/// # Errors
/// Anything but a regular file or a link to one, and the errors of the file system.
pub fn open(path: &Path) -> io::Result<File> {
    check(path)?;
    File::open(path)
}

/// Reads a regular file as a whole.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    check(path)?;
    fs::read(path)
}

/// Reads a regular file of UTF-8 text.
///
/// # Errors
/// As [`open`], and text that is not UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    check(path)?;
    fs::read_to_string(path)
}

/// True for a regular file, false where there is nothing.
///
/// # Errors
/// Anything else that is there, and the errors of the file system.
pub fn exists(path: &Path) -> io::Result<bool> {
    match check(path) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            Ok(false)
        }
        checked => checked.map(|()| true),
    }
}

/// Fails for anything at `path` but a regular file; links count as something else.
///
/// # Errors
/// As [`open`], and a link.
pub fn not_a_link(path: &Path) -> io::Result<()> {
    check_kind(fs::symlink_metadata(path)?.file_type())
}

fn check(path: &Path) -> io::Result<()> {
    check_kind(fs::metadata(path)?.file_type())
}

fn check_kind(kind: FileType) -> io::Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    if kind.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    let problem = format!("is a {}, not a regular file", special_name(kind));
    Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
}

/// Name of a file type that is not a regular file.
pub(crate) fn special_name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "FIFO";
        }
        if kind.is_socket() {
            return "socket";
        }
        if kind.is_block_device() {
            return "block device";
        }
        if kind.is_char_device() {
            return "character device";
        }
    }
    match kind {
        _ if kind.is_symlink() => "symbolic link",
        _ if kind.is_dir() => "directory",
        _ => "special file",
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn special_files_are_refused_without_opening_them() {
        let folder = tempfile::tempdir().unwrap();
        let fifo = folder.path().join("fifo");
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
        for (path, name) in [
            (fifo, "a FIFO"),
            (folder.path().join("socket"), "a socket"),
            (Path::new("/dev/zero").to_path_buf(), "a character device"),
        ] {
            assert!(read(&path).unwrap_err().to_string().contains(name), "{name}");
            assert!(exists(&path).unwrap_err().to_string().contains(name), "{name}");
        }
        let file = folder.path().join("file");
        assert!(!exists(&file).unwrap() && !exists(&file.join("below")).unwrap());
        fs::write(&file, "").unwrap();
        assert!(exists(&file).unwrap() && !exists(&file.join("below")).unwrap());
        assert_eq!(read(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
    }
}
