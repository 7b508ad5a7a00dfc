//! Errors.

/// Why a recording could not be written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A message or the file.
    #[error("cannot write the recording: {0}")]
    Mcap(#[from] mcap::McapError),
    /// A message that does not encode.
    #[error("cannot encode a message: {0}")]
    Message(String),
    /// A picture that does not encode.
    #[error("cannot encode a picture: {0}")]
    Picture(#[from] image::ImageError),
    /// `speeds.csv` of the run.
    #[error("{0}")]
    Speeds(String),
}

impl Error {
    /// The program's exit code: 3 for input that does not read, 5 for a file that cannot be written.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Speeds(_) => 3,
            Self::Mcap(_) | Self::Message(_) | Self::Picture(_) => 5,
        }
    }
}
