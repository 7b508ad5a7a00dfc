//! Inputs from files in place of stages, or as help for them: `--trajectory`, `--vehicle-poses`, `--keypoints`.

use anyhow::bail;
use motorcade::{External, ExternalTrajectory, KeypointTable, read_vehicle_poses};
use motorcade_dataset::{Trajectory, read_trajectory};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_shape::ShapePrior;

use crate::arguments::{RunArguments, TrajectoryScale};

/// Reads the external inputs of a run, fitted to its frames.
pub fn read(arguments: &RunArguments, numbers: &[u64], timestamps_ns: &[i64]) -> anyhow::Result<External> {
    let trajectory = match &arguments.trajectory {
        Some(path) => {
            let whole: Trajectory<World, Camera> = read_trajectory(path)?;
            let Some(world_from_camera) = fit(&whole, numbers, timestamps_ns) else {
                bail!(motorcade::Error::Input(format!(
                    "{}: holds {} poses for {} frames (numbers {} to {}); expected one a frame of the run, one for every \
                     frame number from 0, or TUM times within half a frame of the frames' own",
                    path.display(),
                    whole.poses.len(),
                    numbers.len(),
                    numbers.first().copied().unwrap_or(0),
                    numbers.last().copied().unwrap_or(0),
                )));
            };
            Some(ExternalTrajectory {
                world_from_camera,
                metric: arguments.trajectory_scale == TrajectoryScale::Metric,
            })
        }
        None => None,
    };
    let vehicles = match arguments.vehicle_poses.as_slice() {
        [] => None,
        paths => Some(read_vehicle_poses(paths)?),
    };
    let keypoints = arguments.keypoints.as_deref().map(KeypointTable::read).transpose()?;
    let shape_prior = arguments.shape_prior.as_deref().map(ShapePrior::read).transpose()?;
    Ok(External { trajectory, vehicles, keypoints, shape_prior })
}

/// One pose a frame: by row, by frame number, or by time.
fn fit(
    whole: &Trajectory<World, Camera>,
    numbers: &[u64],
    timestamps_ns: &[i64],
) -> Option<Vec<Pose<World, Camera>>> {
    if whole.poses.len() == numbers.len() {
        return Some(whole.poses.clone());
    }
    match &whole.timestamps_ns {
        None => numbers.iter().map(|n| whole.poses.get(usize::try_from(*n).ok()?).copied()).collect(),
        Some(times) => {
            let span = timestamps_ns.last()? - timestamps_ns.first()?;
            let half_frame = span / (2 * (timestamps_ns.len() as i64 - 1).max(1)) + 1;
            let nearest = |t: &i64| {
                let k = (0..times.len()).min_by_key(|k| times[*k].abs_diff(*t))?;
                (times[k].abs_diff(*t) <= half_frame.unsigned_abs()).then(|| whole.poses[k])
            };
            timestamps_ns.iter().map(nearest).collect()
        }
    }
}
