//! Errors that end a batch. A failing drive is none: it is a line of the summary.

use std::io;
use std::path::{Path, PathBuf};

/// Why a batch ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A manifest that does not say what is to be run.
    #[error("{}:{line}: {problem}", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// Line, from 1, the header's included; of Parquet the row, from 1.
        line: u64,
        /// What is wrong and what was expected.
        problem: String,
    },
    /// A file that does not read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file that cannot be written: the batch cannot say what is done.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A Parquet file that does not read.
    #[error(transparent)]
    Parquet(#[from] motorcade_tables::Error),
}

impl Error {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_path_buf(), source }
    }

    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_path_buf(), source }
    }

    pub(crate) fn manifest(path: &Path, line: u64, problem: impl Into<String>) -> Self {
        Self::Manifest { path: path.to_path_buf(), line, problem: problem.into() }
    }

    /// The program's exit code: 3 input, 5 resources.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Write { .. }) { 5 } else { 3 }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
