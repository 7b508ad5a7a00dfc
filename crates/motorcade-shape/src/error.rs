//! Errors of priors and fits.

use std::path::PathBuf;

/// Error of a shape prior.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PriorError {
    /// Error of the operating system.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Its error.
        source: std::io::Error,
    },
    /// A file that is not JSON, or has missing or unknown fields.
    #[error("{path}: not a shape prior: {source}", path = .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The parser's error, with line and column.
        source: serde_json::Error,
    },
    /// An invalid value of a field.
    #[error("{origin}: {field}: expected {expected}, found {found}")]
    Field {
        /// The file, or "shape prior" for one made in memory.
        origin: String,
        /// Path of the field, as `keypoints[3].mirror`.
        field: String,
        /// Expected content.
        expected: String,
        /// Found content.
        found: String,
    },
    /// An invalid line of a table of numbers.
    #[error("{path}:{line}: expected {expected}, found {found}", path = .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Its line, counted from 1.
        line: usize,
        /// Expected content.
        expected: String,
        /// Found content.
        found: String,
    },
}

/// Error of a fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
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
        /// Keypoints of sufficient confidence.
        found: usize,
        /// Required number (fewer with a road plane than without).
        needed: usize,
        /// The sufficient confidence.
        min_confidence: f64,
    },
    /// A number of the input is not finite or out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Name of the number.
        what: String,
        /// Expected value.
        expected: String,
        /// Found value.
        found: f64,
    },
    /// Invalid intrinsics.
    #[error("{0}")]
    Camera(#[from] motorcade_geometry::InvalidCamera),
    /// No vehicle in front of the camera explains the keypoints.
    #[error("no vehicle in front of the camera explains the keypoints")]
    NoSolution,
}
