//! Errors.

use std::path::PathBuf;

/// Why a run cannot be placed on the map.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A track that does not read.
    #[error("{}:{line}: {problem}", path.display())]
    Track {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What was expected.
        problem: String,
    },
    /// A track and a run that do not fit together.
    #[error("{0}")]
    Alignment(String),
    /// A place that cannot be.
    #[error("{0}")]
    Start(String),
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
}

impl Error {
    /// The program's exit code.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Start(_)) { 1 } else { 3 }
    }
}
