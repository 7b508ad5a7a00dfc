//! Errors.

/// Why a run cannot be placed on the map.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A track and a run that do not fit together.
    #[error("{0}")]
    Alignment(String),
    /// A place that cannot be.
    #[error("{0}")]
    Start(String),
}

impl Error {
    /// The program's exit code.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Start(_)) { 1 } else { 3 }
    }
}
