//! Errors.

use std::path::PathBuf;

use motorcade_sparse::Unfactorised;

use crate::ids::{FactorId, VariableId};

/// Errors of building, solving, reading and writing graphs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// A factor or query names a variable the graph does not have (any more).
    #[error("variable {0} is not in the graph")]
    UnknownVariable(VariableId),
    /// A covariance that is not among those asked for.
    #[error("the covariance between variables {0} and {1} is not among those asked for")]
    NotAskedFor(VariableId, VariableId),
    /// A factor, or its group, that the graph does not have (any more).
    #[error("factor {0} or its group is not in the graph")]
    UnknownFactor(FactorId),
    /// Values of a state that do not fit together.
    #[error("the values of the state do not fit together")]
    Values,
    /// A factor asked for another type than the variable has.
    #[error("variable {variable} is not a {expected}")]
    WrongType {
        /// The variable.
        variable: VariableId,
        /// The type asked for.
        expected: &'static str,
    },
    /// The information matrix of a factor cannot be used.
    #[error("information matrix: {0}")]
    Information(String),
    /// Sizes that do not fit together.
    #[error("{what}: expected {expected}, found {found}")]
    Size {
        /// The object.
        what: &'static str,
        /// The size needed.
        expected: usize,
        /// The size found.
        found: usize,
    },
    /// A residual or Jacobian is NaN or infinite at the start.
    #[error(
        "the cost is not finite at the start; a measurement, value or information matrix holds NaN or infinity"
    )]
    NotFinite,
    /// The normal equations cannot be solved even undamped variables are held: the graph floats or is degenerate.
    #[error("the normal equations are singular: fix one variable of every component or add a prior")]
    Singular,
    /// Work was given up as asked, or at a time limit, before it had a result.
    #[error("stopped before there was a result")]
    Stopped,
    /// An option out of its range.
    #[error("option {name}: {reason}")]
    Option {
        /// The option.
        name: &'static str,
        /// The reason.
        reason: String,
    },
    /// A line of a file cannot be used.
    #[error("{}:{line}: {message}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The problem and its remedy.
        message: String,
    },
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// Threads could not be started.
    #[error("cannot start threads: {0}")]
    Threads(String),
}

impl GraphError {
    /// The error where there is no factor.
    pub(crate) fn unfactorised(cause: Unfactorised) -> Self {
        match cause {
            Unfactorised::NotPositiveDefinite => Self::Singular,
            Unfactorised::Stopped => Self::Stopped,
        }
    }
}
