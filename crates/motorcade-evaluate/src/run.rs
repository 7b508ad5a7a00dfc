//! Evaluation of a run against a KITTI tracking sequence.

use std::path::Path;

use crate::boxes3d::{self, Boxes3dReport};
use crate::drive::Drive;
use crate::ego::{AlignedTrajectories, EgoReport, report};
use crate::error::Result;
use crate::estimates::Estimates;
use crate::ground_truth::GroundTruth;
use crate::moving::MovingReport;
use crate::nees::{ConsistencyReport, consistency};
use crate::tracking::{self, Tracking2dReport, Tracking3dReport, TrackingFrame};
use crate::vehicle_nees::VehicleConsistency;
use crate::vehicles::{VehicleMeans, VehicleReport};

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
    /// Consistency of the vehicles with their deviations; none without tracks.csv or labels.
    pub vehicles_consistency: Option<VehicleConsistency>,
    /// Reliability of P(moving); none without tracks.csv or labels.
    pub moving: Option<MovingReport>,
    /// Average precision of the 3D boxes of cars by KITTI's rules; none without tracks, or without labels of the camera.
    pub boxes3d: Option<Boxes3dReport>,
    /// 3D tracking of cars by AB3DMOT's definition; none as above.
    pub tracking3d: Option<Tracking3dReport>,
    /// Tracking of the boxes of cars in the image by TrackEval's definition; none as above.
    pub tracking2d: Option<Tracking2dReport>,
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
    let drive = Drive::new(estimates, truth);
    let vehicles = drive.vehicles(&aligned);
    let (vehicles, vehicles_mean, vehicles_consistency) =
        vehicles.map_or((None, None, None), |v| (Some(v.reports), v.means, v.consistency));
    let cars = drive.cars().unwrap_or_default();
    let tracked: Vec<_> = cars.iter().map(|(labels, found)| TrackingFrame::new(labels, found)).collect();
    Ok(Report {
        sequence: truth.sequence.clone(),
        camera: truth.camera,
        first: truth.first,
        ego: report(&aligned),
        consistency: estimates.covariances.as_ref().and_then(|all| consistency(&aligned, all)),
        vehicles_mean,
        vehicles,
        vehicles_consistency,
        moving: drive.moving(&aligned),
        boxes3d: boxes3d::evaluate(&cars),
        tracking3d: tracking::evaluate_3d(&tracked),
        tracking2d: tracking::evaluate_2d(&tracked),
        truth_path_m: aligned.truth.iter().map(|pose| pose.translation().into()).collect(),
    })
}
