//! Reasons why a map is not read.

/// Reason why a map is not read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// The file is something else.
    #[error("no map of motorcade: it does not begin with {0:?}")]
    NoMap(&'static str),
    /// The file is of another version.
    #[error("map of format {found}, this program reads {known}; save it anew with `run --save-map`")]
    Version {
        /// Version of the file.
        found: u32,
        /// Version of this program.
        known: u32,
    },
    /// The file ends early, was changed, or holds values that no map has.
    #[error("damaged map: {0}")]
    Damaged(String),
}
