//! Inputs from files in place of stages, or as help for them: `--trajectory`, `--speed`, `--gps`, `--vehicle-poses`, `--keypoints`,
//! `--map`.

use motorcade::{Config, External, ExternalFiles};

use crate::arguments::{RunArguments, TrajectoryScale};

/// Reads the external inputs of a run, fitted to its frames.
pub fn read(
    arguments: &RunArguments,
    numbers: &[u64],
    timestamps_ns: &[i64],
    config: &Config,
) -> motorcade::Result<External> {
    let files = ExternalFiles {
        trajectory: arguments.trajectory.clone(),
        metric: arguments.trajectory_scale == TrajectoryScale::Metric,
        speed: arguments.speed.clone(),
        gps: arguments.gps.clone(),
        clock_offset: arguments.clock_offset,
        vehicle_poses: arguments.vehicle_poses.clone(),
        keypoints: arguments.keypoints.clone(),
        map: arguments.map.clone(),
        shape_prior: arguments.shape_prior.clone(),
    };
    files.read(numbers, timestamps_ns, config)
}
