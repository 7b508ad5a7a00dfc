//! Places that are no plain files: links and FIFOs.

use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A FIFO without a reader.
pub fn make_fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A FIFO and its reader.
pub struct Fifo {
    path: PathBuf,
    reader: File,
}

impl Fifo {
    /// The reader is there before any writer: a shell's `cat fifo &` may come too late, and then waits for ever.
    pub fn new(path: PathBuf) -> Self {
        make_fifo(&path);
        let reader = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(&path).unwrap();
        Self { path, reader }
    }

    /// Text that was written. Fails where the FIFO was replaced.
    #[track_caller]
    pub fn text(mut self) -> String {
        assert!(fs::symlink_metadata(&self.path).unwrap().file_type().is_fifo(), "{:?}", self.path);
        let mut text = String::new();
        self.reader.read_to_string(&mut text).unwrap();
        text
    }
}

/// A link to a file beside it.
pub struct Link {
    path: PathBuf,
    target: PathBuf,
}

impl Link {
    pub fn new(path: PathBuf) -> Self {
        let target = path.with_extension("target");
        fs::write(&target, "").unwrap();
        symlink(target.file_name().unwrap(), &path).unwrap();
        Self { path, target }
    }

    /// Text of the file. Fails where the link was replaced.
    #[track_caller]
    pub fn text(&self) -> String {
        assert!(self.path.is_symlink(), "{:?} is no link any more", self.path);
        fs::read_to_string(&self.target).unwrap()
    }
}
