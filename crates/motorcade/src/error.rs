//! Errors that end a run.

use std::path::PathBuf;

/// Why a run ended without results.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The configuration asks for something that cannot be.
    #[error("{0}")]
    Config(String),
    /// A file of given poses does not fit.
    #[error("{0}")]
    Input(String),
    /// The input.
    #[error(transparent)]
    Dataset(#[from] motorcade_dataset::Error),
    /// Networks, detections or masks.
    #[error(transparent)]
    Perception(#[from] motorcade_perception::Error),
    /// A shape prior.
    #[error(transparent)]
    Shape(#[from] motorcade_shape::PriorError),
    /// The results could not be written.
    #[error("cannot write {path}: {reason}", path = .path.display())]
    Output {
        /// File or folder.
        path: PathBuf,
        /// Reason.
        reason: String,
        /// True when the disk or a quota is full.
        full: bool,
    },
}

impl Error {
    /// Exit code of a program that stops on this error: 1 usage or configuration, 3 input, 5 resources.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Config(_) => 1,
            Self::Input(_) | Self::Shape(_) => 3,
            Self::Dataset(e) => e.exit_code(),
            Self::Perception(e) => e.exit_code(),
            Self::Output { .. } => 5,
        }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
