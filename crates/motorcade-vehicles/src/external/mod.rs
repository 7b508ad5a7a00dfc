//! Views of vehicles from sources other than boxes: keypoints and poses of a file.

mod frame_keypoints;
mod heading_vote;
mod keypoint_track;
mod keypoint_views;
mod pose_file;

use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::trajectory::Source;

pub use keypoint_track::KeypointTrack;
pub use keypoint_views::{KeypointFitters, KeypointViews};
pub use pose_file::external_tracks;

/// Pose of a vehicle in one frame, from keypoints or a file, used in place of or beside its box.
#[derive(Clone, Copy, Debug)]
pub struct ExternalView {
    /// Frame (row of the run).
    pub frame: usize,
    /// Bottom centre, camera frame \[m\].
    pub position_in_camera: Point3<f64>,
    /// Forward direction, camera frame, unit.
    pub forward_in_camera: Vector3<f64>,
    /// Covariance of the position (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Standard deviation of the heading \[rad\].
    pub heading_sigma_rad: f64,
    /// Dependence of the position on the vehicle's size; `None` when it is unknown.
    pub size_dependence: Option<SizeDependence>,
    /// For views without size dependence: standard deviation of the logarithm of a factor on the distance that is common to all
    /// positions of the track. The covariance includes it.
    pub scale_sigma: f64,
    /// Source.
    pub source: Source,
}

/// Dependence of a position on the size it was fitted with.
#[derive(Clone, Copy, Debug)]
pub struct SizeDependence {
    /// The size of the fit.
    pub size: Dimensions,
    /// Derivative of the position by (length, width, height) (3×3, camera frame) \[m/m\].
    pub slope: Matrix3<f64>,
    /// Covariance of the position with the size held (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
}

/// All external views of a vehicle.
#[derive(Clone, Debug, Default)]
pub struct ExternalTrack {
    /// Views, in order of frames.
    pub views: Vec<ExternalView>,
    /// Size from all views together, in place of the class prior.
    pub size: Option<SizePrior>,
}
