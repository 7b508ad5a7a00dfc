//! Evaluation of a run against a KITTI tracking sequence.

use std::path::Path;

use crate::boxes3d::{self, Boxes3dReport};
use crate::ego::{AlignedTrajectories, EgoReport, report};
use crate::error::Result;
use crate::estimates::Estimates;
use crate::ground_truth::GroundTruth;
use crate::matching::by_frame;
use crate::nees::{ConsistencyReport, consistency};
use crate::vehicles::{VehicleMeans, VehicleReport, Vehicles, frame_shift};

/// Errors of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Report {
    /// KITTI tracking sequence.
    pub sequence: String,
    /// Its camera.
    pub camera: u8,
    /// KITTI frame number of the run's row 0.
    pub first: u64,
    /// The camera's trajectory.
    pub ego: EgoReport,
    /// Consistency of the poses with their covariances; none when the run gives no covariances.
    pub consistency: Option<ConsistencyReport>,
    /// Labelled vehicles by identity; none without tracks or labels.
    pub vehicles: Option<Vec<VehicleReport>>,
    /// Their means; none when no labelled vehicle has an estimate.
    pub vehicles_mean: Option<VehicleMeans>,
    /// Average precision of the 3D boxes of cars by KITTI's rules; none without tracks, or without labels of the camera.
    pub boxes3d: Option<Boxes3dReport>,
    /// True positions of the camera, one a row, in the camera of row 0 \[m\]: the world of a run. Not part of the JSON.
    #[serde(skip)]
    pub truth_path_m: Vec<[f64; 3]>,
}

/// Evaluates a run directory (see [`Estimates::read`]) against a KITTI tracking sequence (see [`GroundTruth::read_kitti`]).
///
/// # Errors
/// Files that do not read, and runs with more poses than the ground truth has frames.
pub fn evaluate_run(run: &Path, kitti_root: &Path, sequence: &str, camera: u8, first: u64) -> Result<Report> {
    evaluate(&Estimates::read(run)?, &GroundTruth::read_kitti(kitti_root, sequence, camera, first)?)
}

/// Evaluates estimates against the ground truth of the same frames.
///
/// # Errors
/// Estimates without poses, or with more poses than the ground truth has frames.
pub fn evaluate(estimates: &Estimates, truth: &GroundTruth) -> Result<Report> {
    let estimate = &estimates.world_from_camera;
    let aligned = AlignedTrajectories::new(estimate, truth.poses(estimate.len())?)?;
    let tracks = estimates.tracks.as_ref().map(|tracks| by_frame(tracks.iter().cloned()));
    let vehicles = tracks.as_ref().zip(truth.labels.as_ref()).map(|(tracks, labels)| {
        let drive = Vehicles {
            labels,
            boxes: truth.moved.as_ref().unwrap_or(labels),
            estimates: tracks,
            camera_from_cam0: truth.camera_from_cam0,
            first: truth.first,
            fps: truth.fps,
        };
        drive.evaluate(&aligned)
    });
    let boxes3d = tracks.as_ref().zip(truth.all.as_ref()).and_then(|(tracks, all)| {
        let shift = frame_shift(tracks, truth.first);
        let end = truth.first + estimate.len() as u64;
        let labels = all.range(truth.first..end).map(|(frame, of)| (*frame, of.clone())).collect();
        boxes3d::evaluate(&labels, |frame| tracks.get(&(frame - shift)).cloned().unwrap_or_default())
    });
    let (vehicles, vehicles_mean) = vehicles.map_or((None, None), |(all, mean)| (Some(all), mean));
    Ok(Report {
        sequence: truth.sequence.clone(),
        camera: truth.camera,
        first: truth.first,
        ego: report(&aligned),
        consistency: estimates.covariances.as_ref().and_then(|all| consistency(&aligned, all)),
        vehicles_mean,
        vehicles,
        boxes3d,
        truth_path_m: aligned.truth.iter().map(|pose| pose.translation().into()).collect(),
    })
}
