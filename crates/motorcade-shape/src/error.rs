//! What can go wrong.

use std::path::PathBuf;

/// Why a shape prior was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PriorError {
    /// The operating system refused.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is not JSON, or lacks a field, or has one nobody knows.
    #[error("{path}: not a shape prior: {source}", path = .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What the reader said, with line and column.
        source: serde_json::Error,
    },
    /// A field holds something that cannot be.
    #[error("{origin}: {field}: expected {expected}, found {found}")]
    Field {
        /// The file, or "shape prior" for one made in memory.
        origin: String,
        /// Path of the field, as `keypoints[3].mirror`.
        field: String,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A line of a table of numbers does not read.
    #[error("{path}:{line}: expected {expected}, found {found}", path = .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Its line, counted from 1.
        line: usize,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
}

/// Why a vehicle could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The observation has another number of keypoints than the prior.
    #[error("{found} keypoints seen, but the shape prior `{prior}` has {expected}")]
    KeypointCount {
        /// Name of the prior.
        prior: String,
        /// Keypoints of the prior.
        expected: usize,
        /// Keypoints of the observation.
        found: usize,
    },
    /// Too few keypoints are seen with confidence.
    #[error("{found} keypoints of confidence ≥ {min_confidence}, need {needed}")]
    TooFewKeypoints {
        /// Keypoints confident enough.
        found: usize,
        /// How many are needed (fewer with a road plane than without).
        needed: usize,
        /// The confidence that counts.
        min_confidence: f64,
    },
    /// A number of the input is not finite or out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Which number.
        what: String,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// The intrinsics are of no lens.
    #[error("{0}")]
    Camera(#[from] motorcade_geometry::InvalidCamera),
    /// No vehicle in front of the camera explains the keypoints.
    #[error("no vehicle in front of the camera explains the keypoints")]
    NoSolution,
}
