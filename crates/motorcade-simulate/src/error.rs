//! Errors of simulating and writing a drive.

use std::io;
use std::path::{Path, PathBuf};

/// Error of simulating or writing a drive.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid plan or option.
    #[error("{0}")]
    Plan(String),
    /// The caller asked to stop.
    #[error("interrupted; nothing was written")]
    Cancelled,
    /// A file or folder that cannot be read or written.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// An image that cannot be encoded.
    #[error("{path}: {source}", path = .path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// Error of the encoder.
        source: image::ImageError,
    },
}

impl Error {
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
