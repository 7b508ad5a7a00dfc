//! Why an evaluation was refused.

/// Why an evaluation was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file of the run or of the ground truth.
    #[error(transparent)]
    Input(#[from] motorcade_dataset::Error),
    /// Estimate and ground truth do not go together.
    #[error("{0}")]
    Mismatch(String),
}

impl Error {
    /// Exit code of a program that stops on this error: 1 usage, 3 input unreadable or corrupt, 5 resources.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(error) => error.exit_code(),
            Self::Mismatch(_) => 1,
        }
    }
}

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
