//! `ego.tum`, `ego.kitti.txt`, `ego_covariance.csv`, `frames.csv`.

use std::path::Path;

use motorcade_dataset::{write_kitti, write_tum};
use motorcade_odometry::{FrameStatus, road_tilt};

use super::file;
use crate::error::Result;
use crate::result::RunResult;

pub(super) fn write(folder: &Path, result: &RunResult) -> Result<()> {
    let poses: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
    file(&folder.join("ego.kitti.txt"), |out| write_kitti(out, &poses))?;
    let rows = result.frames.iter().map(|f| f.timestamp_ns).zip(poses.iter().copied());
    file(&folder.join("ego.tum"), |out| write_tum(out, rows))?;
    file(&folder.join("ego_covariance.csv"), |out| covariances(out, result))?;
    file(&folder.join("frames.csv"), |out| frames(out, result))
}

/// Upper triangle of the 6×6 covariance of each pose, row by row: tangent `[ω, ν]` of the camera (right perturbation), rad
/// and m.
fn covariances(out: impl std::io::Write, result: &RunResult) -> std::io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    let axes = ["wx", "wy", "wz", "x", "y", "z"];
    let places = || (0..6).flat_map(|r| (r..6).map(move |c| (r, c)));
    let names = places().map(|(r, c)| format!("{}_{}", axes[r], axes[c]));
    table.write_record(std::iter::once("frame".to_owned()).chain(names))?;
    for (ego, frame) in result.ego.frames.iter().zip(&result.frames) {
        let values = places().map(|at| format!("{:e}", ego.covariance[at]));
        table.write_record(std::iter::once(frame.number.to_string()).chain(values))?;
    }
    table.flush()
}

/// Name of a status in files.
pub fn status_name(status: FrameStatus) -> &'static str {
    match status {
        FrameStatus::Initialising => "filled_in",
        FrameStatus::Tracked => "tracked",
        FrameStatus::Standstill => "standstill",
        FrameStatus::Bridged => "bridged",
    }
}

/// One row a frame.
pub(super) fn frames(out: impl std::io::Write, result: &RunResult) -> std::io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    table.write_record([
        "frame",
        "time_s",
        "status",
        "inliers",
        "speed_mps",
        "scale_m_per_unit",
        "scale_sigma_rel",
        "scale_measured",
        "road_pitch_rad",
        "road_roll_rad",
        "sigma_x_m",
        "sigma_y_m",
        "sigma_z_m",
        "sigma_yaw_rad",
    ])?;
    for (k, (ego, frame)) in result.ego.frames.iter().zip(&result.frames).enumerate() {
        let speed = k.checked_sub(1).map_or(0.0, |before| {
            let interval_ns = frame.timestamp_ns - result.frames[before].timestamp_ns;
            result.way_m(k) / (interval_ns as f64 * 1e-9).max(1e-6)
        });
        let (pitch_rad, roll_rad) = road_tilt(&ego.road_normal);
        let sigma = |i: usize| ego.covariance[(i, i)].max(0.0).sqrt();
        let number = |v: f64| format!("{v:.6}");
        table.write_record([
            frame.number.to_string(),
            format!("{:.6}", frame.timestamp_ns as f64 * 1e-9),
            status_name(ego.status).to_owned(),
            ego.inliers.to_string(),
            number(speed),
            number(ego.scale),
            number(ego.scale_sigma.hypot(ego.scale_bias_sigma)),
            ego.scale_measured.to_string(),
            number(pitch_rad),
            number(roll_rad),
            number(sigma(3)),
            number(sigma(4)),
            number(sigma(5)),
            number(sigma(1)),
        ])?;
    }
    table.flush()
}
