//! Evaluation of a result in memory.

use std::path::Path;

use motorcade::{RunContext, RunResult, output};
use motorcade_evaluate::{Estimates, GroundTruth, Report, evaluate};

/// Evaluates a result against a KITTI tracking split.
///
/// # Errors
/// Ground truth that does not read or has fewer frames.
pub fn evaluate_result(result: &RunResult, context: &RunContext, kitti: &Path) -> anyhow::Result<Report> {
    let estimates = Estimates {
        world_from_camera: result.ego.frames.iter().map(|f| f.world_from_camera).collect(),
        covariances: Some(result.ego.frames.iter().map(|f| f.covariance).collect()),
        tracks: Some(output::track_labels(result, context.camera_from_cam0)),
        deviations: None,
    }
    .with_track_table(&output::tracks_csv(result))?;
    let sequence = context.input.sequence.clone().unwrap_or_default();
    let camera = context.input.camera.unwrap_or(2);
    let first = result.frames.first().map_or(0, |f| f.number);
    Ok(evaluate(&estimates, &GroundTruth::read_kitti(kitti, &sequence, camera, first)?)?)
}
