//! Failures of a factorisation.

use std::fmt;

/// Why there is no factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfactorised {
    /// The matrix was not positive definite.
    NotPositiveDefinite,
    /// The factorisation was given up as asked.
    Stopped,
}

impl fmt::Display for Unfactorised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotPositiveDefinite => "the matrix is not positive definite",
            Self::Stopped => "the factorisation was stopped",
        })
    }
}

impl std::error::Error for Unfactorised {}
