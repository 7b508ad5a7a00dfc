//! Errors of networks and perception files.

use std::path::{Path, PathBuf};

/// Why perception was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file of detections or masks.
    #[error(transparent)]
    Input(#[from] motorcade_dataset::Error),
    /// A network or its manifest.
    #[error("{path}: {problem}", path = .path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// Problem and remedy.
        problem: String,
    },
    /// A detector of the caller failed.
    #[error(transparent)]
    Detector(Box<dyn std::error::Error + Send + Sync>),
    /// The inference engine is missing.
    #[error("{problem}")]
    Engine {
        /// Missing part and how to get it.
        problem: String,
    },
}

impl Error {
    /// Exit code of a program that stops on this error: 1 usage, 3 input unreadable or corrupt, 5 resources.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(error) => error.exit_code(),
            Self::Model { .. } | Self::Detector(_) => 3,
            Self::Engine { .. } => 5,
        }
    }

    /// A network that takes something else than one image.
    pub(crate) fn inputs(path: &Path, count: usize) -> Self {
        Self::model(path, format!("has {count} inputs, expected one image"))
    }

    pub(crate) fn model(path: &Path, problem: impl Into<String>) -> Self {
        Self::Model { path: path.to_path_buf(), problem: problem.into() }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
