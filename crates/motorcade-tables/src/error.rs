//! Errors.

use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;

/// Why a table could not be made, written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Columns that do not make a table.
    #[error("table {table}: {problem}")]
    Table {
        /// Name of the table.
        table: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The file could not be encoded or written.
    #[error("cannot write table {table}: {source}")]
    Write {
        /// Name of the table.
        table: String,
        /// The cause.
        source: ParquetError,
    },
    /// A Parquet file that does not read.
    #[error("{}: {problem}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What was expected, and what to do.
        problem: String,
    },
    /// The file cannot be opened.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The files of a run.
    #[error(transparent)]
    Dataset(#[from] motorcade_dataset::Error),
    /// A run, or the place of the results.
    #[error(transparent)]
    Run(#[from] motorcade::Error),
}

impl Error {
    pub(crate) fn input(path: &Path, problem: String) -> Self {
        Self::Dataset(motorcade_dataset::Error::Input { path: path.to_path_buf(), problem })
    }

    pub(crate) fn parquet(path: &Path, problem: impl std::fmt::Display) -> Self {
        Self::Parquet { path: path.to_path_buf(), problem: problem.to_string() }
    }

    /// The program's exit code: 2 for a table that is not one, 3 for input that does not read, 5 for a file that cannot be written.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Table { .. } => 2,
            Self::Parquet { .. } | Self::Read { .. } => 3,
            Self::Write { .. } => 5,
            Self::Dataset(e) => e.exit_code(),
            Self::Run(e) => e.exit_code(),
        }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
