//! Errors of the camera's trajectory.

use motorcade_geometry::alignment::umeyama;
use motorcade_geometry::lie::sim3::Similarity;
use motorcade_geometry::robust::{median_midpoint, quantile};
use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Point3, Vector3};

use crate::error::{Error, Result};
use crate::statistics::rms;

/// True steps shorter than this are excluded from the scale error: they are within the noise of the ground truth \[m\].
const MOVING_M: f64 = 0.2;
/// Half the window of scale over time \[frames\].
const SCALE_HALF_WINDOW: usize = 5;
/// Windows with a shorter true path are excluded \[m\].
const SCALE_PATH_M: f64 = 1.0;
/// Shortest true path for which a rotation drift per length is given \[m\].
const DRIFT_PATH_M: f64 = 20.0;

/// Scale around one frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ScalePoint {
    /// Row of the run.
    pub row: usize,
    /// Path length estimated / true over ±5 frames, minus 1 \[%\].
    pub error_pct: f64,
}

/// Errors of the camera's trajectory. Positions in metres; every ATE names its alignment.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct EgoReport {
    /// Compared frames.
    pub frames: usize,
    /// Length of the true path \[m\].
    pub length_m: f64,
    /// RMS of positions, first poses identified \[m\].
    pub ate_origin_m: f64,
    /// RMS of positions after the best rotation and translation \[m\].
    pub ate_se3_m: f64,
    /// RMS of positions after the best rotation, translation and scale \[m\]; none when the estimate does not move.
    pub ate_sim3_m: Option<f64>,
    /// The scale of that alignment: true / estimated.
    pub best_scale: Option<f64>,
    /// Median over moving frames of |step estimated / step true − 1| \[%\].
    pub scale_error_pct_median: Option<f64>,
    /// Median of |scale error| over windows of ±5 frames \[%\]: single steps of a GPS/INS truth jitter by 5 %.
    pub scale_window_pct_median: Option<f64>,
    /// 95th percentile of the same \[%\].
    pub scale_window_pct_p95: Option<f64>,
    /// RMS of the translation error from frame to frame \[m\].
    pub rpe_m: Option<f64>,
    /// RMS of the rotation error from frame to frame \[deg\].
    pub rpe_deg: Option<f64>,
    /// Rotation error of the last frame, first poses identified \[deg\].
    pub rotation_end_deg: f64,
    /// The same per length \[deg/100 m\]; none under 20 m.
    pub rotation_deg_per_100m: Option<f64>,
    /// Scale error along the drive, where the camera moves.
    pub scale_over_time: Vec<ScalePoint>,
}

/// Trajectories with a common first pose, and the SE(3) alignment between them.
pub(crate) struct AlignedTrajectories {
    pub estimate: Vec<Pose<World, Camera>>,
    pub truth: Vec<Pose<World, Camera>>,
    /// `truth_from_estimate`, scale 1.
    pub se3: Similarity,
}

impl AlignedTrajectories {
    pub(crate) fn new(estimate: &[Pose<World, Camera>], truth: &[Pose<World, Camera>]) -> Result<Self> {
        if estimate.len() != truth.len() {
            let (n, m) = (estimate.len(), truth.len());
            return Err(Error::Mismatch(format!(
                "the run has {n} poses, the ground truth {m} for the same frames"
            )));
        }
        let (estimate, truth) = (from_first(estimate), from_first(truth));
        let se3 = umeyama(&positions(&estimate), &positions(&truth), false)
            .ok_or_else(|| Error::Mismatch("there are no poses to compare".into()))?;
        Ok(Self { estimate, truth, se3 })
    }
}

fn from_first(poses: &[Pose<World, Camera>]) -> Vec<Pose<World, Camera>> {
    let Some(first) = poses.first() else { return Vec::new() };
    // The new world is the first camera.
    let world_from_world = first.inverse().cast::<World, World>();
    poses.iter().map(|pose| world_from_world * *pose).collect()
}

fn positions(poses: &[Pose<World, Camera>]) -> Vec<Vector3<f64>> {
    poses.iter().map(Pose::translation).collect()
}

fn steps(positions: &[Vector3<f64>]) -> Vec<f64> {
    positions.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect()
}

/// Compares `world_from_camera` poses row by row; the worlds need not agree.
///
/// # Errors
/// Lists of different lengths, or empty ones.
pub fn evaluate_trajectory(
    estimate: &[Pose<World, Camera>],
    truth: &[Pose<World, Camera>],
) -> Result<EgoReport> {
    AlignedTrajectories::new(estimate, truth).map(|aligned| report(&aligned))
}

pub(crate) fn report(aligned: &AlignedTrajectories) -> EgoReport {
    let (estimate, truth) = (&aligned.estimate, &aligned.truth);
    let (estimated, true_positions) = (positions(estimate), positions(truth));
    let (estimated_steps, true_steps) = (steps(&estimated), steps(&true_positions));
    let length_m: f64 = true_steps.iter().sum();
    let ate = |alignment: &Similarity| {
        let errors = estimated.iter().zip(&true_positions);
        rms(errors.map(|(e, t)| alignment.transform_point(&Point3::from(*e)).coords - t))
    };
    let sim3 = umeyama(&estimated, &true_positions, true);
    let moving = estimated_steps.iter().zip(&true_steps).filter(|(_, true_step)| **true_step > MOVING_M);
    let mut scale_errors: Vec<f64> = moving.map(|(e, t)| (e / t - 1.0).abs() * 100.0).collect();
    let relative: Vec<Pose<Camera, Camera>> = estimate
        .windows(2)
        .zip(truth.windows(2))
        .map(|(e, t)| (t[0].inverse() * t[1]).inverse() * (e[0].inverse() * e[1]))
        .collect();
    let scale_over_time = scale_over_time(&estimated_steps, &true_steps);
    let mut windows: Vec<f64> = scale_over_time.iter().map(|point| point.error_pct.abs()).collect();
    let end = estimate.last().zip(truth.last());
    let rotation_end_deg = end.map_or(0.0, |(e, t)| e.rotation().angle_to(&t.rotation()).to_degrees());
    let angle = |pose: &Pose<Camera, Camera>| Vector3::new(pose.rotation().angle().to_degrees(), 0.0, 0.0);
    EgoReport {
        frames: estimate.len(),
        length_m,
        ate_origin_m: ate(&Similarity::identity()).unwrap_or(0.0),
        ate_se3_m: ate(&aligned.se3).unwrap_or(0.0),
        ate_sim3_m: sim3.as_ref().and_then(ate),
        best_scale: sim3.as_ref().map(|similarity| similarity.scale),
        scale_error_pct_median: median_midpoint(&mut scale_errors),
        scale_window_pct_median: median_midpoint(&mut windows),
        scale_window_pct_p95: quantile(&mut windows, 0.95),
        rpe_m: rms(relative.iter().map(Pose::translation)),
        rpe_deg: rms(relative.iter().map(angle)),
        rotation_end_deg,
        rotation_deg_per_100m: (length_m > DRIFT_PATH_M).then(|| rotation_end_deg / length_m * 100.0),
        scale_over_time,
    }
}

fn scale_over_time(estimated: &[f64], truth: &[f64]) -> Vec<ScalePoint> {
    let point = |row: usize| {
        let window = row.saturating_sub(SCALE_HALF_WINDOW)..(row + SCALE_HALF_WINDOW).min(truth.len());
        let path = |steps: &[f64]| steps[window.clone()].iter().sum::<f64>();
        let true_path = path(truth);
        (true_path > SCALE_PATH_M)
            .then(|| ScalePoint { row, error_pct: (path(estimated) / true_path - 1.0) * 100.0 })
    };
    (0..=truth.len()).filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn drive(scale: f64) -> Vec<Pose<World, Camera>> {
        let pose = |i: i32| {
            let s = f64::from(i);
            let position = Vector3::new(0.02 * s * s, 0.0, s) * scale;
            Pose::from_parts(UnitQuaternion::from_euler_angles(0.0, 0.04 * s, 0.0), position)
        };
        (0..40).map(pose).collect()
    }

    #[test]
    fn a_scaled_drive_has_only_a_scale_error() {
        let report = evaluate_trajectory(&drive(1.1), &drive(1.0)).unwrap();
        assert!((report.best_scale.unwrap() - 1.0 / 1.1).abs() < 1e-12);
        assert!(
            report.ate_sim3_m.unwrap() < 1e-9
                && report.ate_se3_m > 0.5
                && report.ate_origin_m > report.ate_se3_m
        );
        assert!((report.scale_error_pct_median.unwrap() - 10.0).abs() < 1e-9);
        assert!(report.scale_over_time.iter().all(|point| (point.error_pct - 10.0).abs() < 1e-9));
        assert_eq!(report.scale_over_time.len(), 40);
        assert!(report.rotation_end_deg < 1e-9);
    }

    #[test]
    fn the_world_of_the_estimate_does_not_matter() {
        let moved = Pose::<World, World>::from_parts(
            UnitQuaternion::from_euler_angles(0.3, 1.0, -0.2),
            Vector3::new(5.0, 6.0, 7.0),
        );
        let elsewhere: Vec<_> = drive(1.0).into_iter().map(|pose| moved * pose).collect();
        let report = evaluate_trajectory(&elsewhere, &drive(1.0)).unwrap();
        assert!(report.ate_origin_m < 1e-9 && report.rpe_m.unwrap() < 1e-9);
    }

    #[test]
    fn standing_still_and_mismatches_are_answered() {
        let still = vec![Pose::identity(); 5];
        let report = evaluate_trajectory(&still, &still).unwrap();
        assert_eq!(
            (report.ate_origin_m, report.best_scale, report.scale_error_pct_median),
            (0.0, None, None)
        );
        assert_eq!(evaluate_trajectory(&still, &drive(1.0)).unwrap_err().exit_code(), 1);
        assert!(evaluate_trajectory(&[], &[]).is_err());
    }
}
