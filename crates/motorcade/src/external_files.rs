//! Files of external inputs.

use std::path::PathBuf;

use motorcade_dataset::{ClockOffset, Trajectory, read_trajectory, read_vehicle_poses};
use motorcade_geometry::{Camera, Pose, World};
use motorcade_perception::KeypointTable;
use motorcade_shape::ShapePrior;

use crate::config::Config;
use crate::distances::Distances;
use crate::error::{Error, Result};
use crate::external::External;
use crate::kept_map::KeptMap;
use crate::motion_source::ExternalTrajectory;

/// Files in place of stages, or as help for them; all absent by default.
#[derive(Clone, Debug, Default)]
pub struct ExternalFiles {
    /// Camera trajectory (TUM or KITTI, of the processed camera) in place of odometry.
    pub trajectory: Option<PathBuf>,
    /// True when that trajectory is in metres.
    pub metric: bool,
    /// Speeds of the car (CSV), beside the height of the camera.
    pub speed: Option<PathBuf>,
    /// GPS track (GPX, NMEA, CSV), beside the height of the camera.
    pub gps: Option<PathBuf>,
    /// Offset from the clock of the frames to that of `speed` or `gps`.
    pub clock_offset: Option<ClockOffset>,
    /// Vehicle poses in place of vehicle localisation.
    pub vehicle_poses: Vec<PathBuf>,
    /// Keypoints of vehicles, by frame number.
    pub keypoints: Option<PathBuf>,
    /// Map of places that an earlier drive kept.
    pub map: Option<PathBuf>,
    /// Shape prior in place of the built-in one for keypoints of its number.
    pub shape_prior: Option<PathBuf>,
}

impl ExternalFiles {
    /// Reads the files, fitted to the frames of a run with these numbers and times \[ns\] and this configuration.
    ///
    /// # Errors
    /// A file that does not read; a trajectory without a pose for every frame; speeds or a track of another time; both of them.
    pub fn read(&self, numbers: &[u64], timestamps_ns: &[i64], config: &Config) -> Result<External> {
        let trajectory = self.read_trajectory(numbers, timestamps_ns)?;
        let vehicles = match self.vehicle_poses.as_slice() {
            [] => None,
            paths => Some(read_vehicle_poses(paths)?),
        };
        Ok(External {
            trajectory,
            distances: self.read_distances(timestamps_ns, config)?,
            vehicles,
            keypoints: self.keypoints.as_deref().map(KeypointTable::read).transpose()?,
            map: self.map.as_deref().map(KeptMap::read).transpose()?,
            shape_prior: self.shape_prior.as_deref().map(ShapePrior::read).transpose()?,
        })
    }

    fn read_distances(&self, timestamps_ns: &[i64], config: &Config) -> Result<Option<Distances>> {
        let (path, distances) = match (&self.speed, &self.gps) {
            (None, None) => return Ok(None),
            (Some(path), None) => (path, Distances::of_speeds(path, self.clock_offset)?),
            (None, Some(path)) => (path, Distances::of_track(path, self.clock_offset)?),
            (Some(_), Some(_)) => {
                return Err(Error::Config("give either speeds or a GPS track, not both".to_owned()));
            }
        };
        match distances.problem(timestamps_ns, &config.scale.distances) {
            Some(problem) => Err(Error::Input(format!("{}: {problem}", path.display()))),
            None => Ok(Some(distances)),
        }
    }

    fn read_trajectory(&self, numbers: &[u64], timestamps_ns: &[i64]) -> Result<Option<ExternalTrajectory>> {
        let Some(path) = &self.trajectory else { return Ok(None) };
        let whole: Trajectory<World, Camera> = read_trajectory(path)?;
        let Some(world_from_camera) = fit(&whole, numbers, timestamps_ns) else {
            return Err(Error::Input(format!(
                "{}: holds {} poses for {} frames (numbers {} to {}); expected one a frame of the run, one for every \
                 frame number from 0, or TUM times within half a frame of the frames' own",
                path.display(),
                whole.poses.len(),
                numbers.len(),
                numbers.first().copied().unwrap_or(0),
                numbers.last().copied().unwrap_or(0),
            )));
        };
        Ok(Some(ExternalTrajectory { world_from_camera, metric: self.metric }))
    }
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
