//! A drive's log, locked while a process writes to it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::Stdio;

/// A log, open for more lines. The lock belongs to the open file, so that a process that inherits it keeps it.
pub(crate) struct Log {
    file: File,
    /// Where the present attempt began.
    start: u64,
}

impl Log {
    /// Opens the log, or makes it.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        Ok(Self { file, start: 0 })
    }

    /// True when this process has it alone. File systems without locks leave it to the user to start one batch a shard.
    pub(crate) fn try_lock(&self) -> bool {
        !matches!(self.file.try_lock(), Err(TryLockError::WouldBlock))
    }

    /// Begins an attempt with a line.
    pub(crate) fn begin(&mut self, line: &str) -> io::Result<()> {
        self.start = self.file.seek(SeekFrom::End(0))?;
        writeln!(self.file, "{line}")
    }

    /// For a process to write to.
    pub(crate) fn stdio(&self) -> io::Result<Stdio> {
        self.file.try_clone().map(Stdio::from)
    }

    /// The last message of the present attempt: the program's own where there is one, else the last line.
    pub(crate) fn last_message(&mut self) -> String {
        const MOST: u64 = 8192;
        let read = |file: &mut File, start: u64| -> io::Result<String> {
            let end = file.seek(SeekFrom::End(0))?;
            file.seek(SeekFrom::Start(start.max(end.saturating_sub(MOST))))?;
            let mut bytes = Vec::new();
            file.take(MOST).read_to_end(&mut bytes)?;
            Ok(String::from_utf8_lossy(&bytes).into_owned())
        };
        let text = read(&mut self.file, self.start).unwrap_or_default();
        let mut lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#')).rev();
        let own = lines.clone().find_map(|line| line.strip_prefix("motorcade: "));
        own.or_else(|| lines.next()).unwrap_or_default().trim().to_owned()
    }
}
