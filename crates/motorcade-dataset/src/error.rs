//! Errors of input; each names the file, the line or frame, and what to do.

use std::io;
use std::path::{Path, PathBuf};

/// Error of an input.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Invalid options.
    #[error("{0}")]
    Usage(String),
    /// Error of the operating system.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Its error.
        source: io::Error,
    },
    /// A folder or file without the expected content.
    #[error("{path}: {problem}", path = .path.display())]
    Input {
        /// The file or folder.
        path: PathBuf,
        /// The problem and what to do.
        problem: String,
    },
    /// An invalid line of a text file.
    #[error("{path}:{line}: expected {expected}, found {found}", path = .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Its line, counted from 1.
        line: usize,
        /// Expected content.
        expected: String,
        /// Found content.
        found: String,
    },
    /// A place in a text file that is wrong.
    #[error("{path}:{line}: {problem}", path = .path.display())]
    AtLine {
        /// The file.
        path: PathBuf,
        /// Its line, counted from 1.
        line: usize,
        /// What was expected.
        problem: String,
    },
    /// Two sizes that must be equal differ.
    #[error("{path}: {what} is {found_width}x{found_height} but {against} is {width}x{height}; {advice}", path = .path.display())]
    Size {
        /// The offending file.
        path: PathBuf,
        /// Its content.
        what: &'static str,
        /// Its width \[px\].
        found_width: u32,
        /// Its height \[px\].
        found_height: u32,
        /// The file it is compared with.
        against: &'static str,
        /// The other width \[px\].
        width: u32,
        /// The other height \[px\].
        height: u32,
        /// Advice for the user.
        advice: &'static str,
    },
    /// A required program is missing or fails.
    #[error("the program `{program}` {problem}; {advice}")]
    Program {
        /// Its name.
        program: String,
        /// The problem.
        problem: String,
        /// Advice for the user.
        advice: &'static str,
    },
}

impl Error {
    /// Exit code of a program that stops on this error: 1 usage, 3 input unreadable or corrupt, 5 resources.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 1,
            Self::Io { source, .. } => match source.kind() {
                io::ErrorKind::OutOfMemory | io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => 5,
                _ => 3,
            },
            Self::Input { .. } | Self::Line { .. } | Self::AtLine { .. } | Self::Size { .. } => 3,
            Self::Program { .. } => 5,
        }
    }

    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }

    pub(crate) fn input(path: &Path, problem: impl Into<String>) -> Self {
        Self::Input { path: path.to_path_buf(), problem: problem.into() }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
