//! Result of a fit to a track.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::{Matrix3, Matrix6};

use super::super::track_shape::TrackShape;
use crate::dimensions::Dimensions;
use crate::error::FitError;

/// A vehicle's pose in one frame of its track.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FrameFit {
    /// Pose \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose (6×6 `[ω, ν]`, vehicle frame), the shared shape marginalised.
    pub covariance: Matrix6<f64>,
    /// True for keypoints within the gate, in the order of the observation.
    pub inliers: Vec<bool>,
    /// Robust standard deviation of the whitened keypoint residuals.
    pub residual_sigma: f64,
    /// True when the network's left and right points were exchanged.
    pub sides_swapped: bool,
    /// Cost of the frame without the terms of the shape.
    pub cost: f64,
    /// Cost difference to the opposite heading in this frame alone; negative when the track's shape reversed it.
    pub heading_margin: f64,
}

/// Fit of a vehicle over its track.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrackFit {
    /// One entry per observation: its pose, or its error.
    pub frames: Vec<Result<FrameFit, FitError>>,
    /// Shape coefficients λ shared by all frames.
    pub coefficients: Vec<f64>,
    /// The shape, to fit further frames with.
    pub shape: TrackShape,
    /// Outer size of the shape.
    pub dimensions: Dimensions,
    /// Covariance of the outer size (length, width, height) \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Total robust cost.
    pub cost: f64,
}
