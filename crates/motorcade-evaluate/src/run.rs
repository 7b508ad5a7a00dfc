//! A run directory against a KITTI tracking sequence.

use std::path::Path;

use motorcade_dataset::{Cam0, Error as InputError, KittiCalibration, Label, read_labels, read_trajectory};
use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Matrix6;

use crate::consistency::{ConsistencyReport, consistency, read_covariances};
use crate::ego::{Compared, EgoReport, report};
use crate::error::{Error, Result};
use crate::matching::by_frame;
use crate::vehicles::{VehicleMeans, VehicleReport, Vehicles, means};

/// Labelled vehicles farther than this \[m\] do not count.
const RANGE_M: f64 = 50.0;
/// Labels that are no vehicles.
const NO_VEHICLES: [&str; 7] =
    ["DontCare", "Pedestrian", "Cyclist", "Person", "Person_sitting", "Misc", "Tram"];

/// How good a run is.
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
    /// Whether the poses' covariances fit their errors; none when the run gives no covariances.
    pub consistency: Option<ConsistencyReport>,
    /// Labelled vehicles by identity; none when the run gives no tracks.
    pub vehicles: Option<Vec<VehicleReport>>,
    /// Their means; none when no labelled vehicle has an estimate.
    pub vehicles_mean: Option<VehicleMeans>,
    /// True positions of the camera, one a row, in the camera of row 0 \[m\]: the world of a run. Not part of the JSON.
    #[serde(skip)]
    pub truth_path_m: Vec<[f64; 3]>,
}

/// Trajectories of a run, in memory.
#[derive(Clone, Debug, Default)]
pub struct RunTrajectories {
    /// `world_from_camera` of each frame.
    pub ego: Vec<Pose<World, Camera>>,
    /// Covariance of each pose (6×6, tangent `[ω, ν]` of the camera, rad and m); none when not known.
    pub covariances: Option<Vec<Matrix6<f64>>>,
    /// Vehicles as KITTI tracking results; none when not known.
    pub tracks: Option<Vec<Label>>,
}

impl RunTrajectories {
    /// Reads a run directory: `ego.kitti.txt` or `ego.tum`, `tracks.kitti.txt` and `ego_covariance.csv` when there.
    ///
    /// # Errors
    /// Files that do not read.
    pub fn read(run: &Path) -> Result<Self> {
        let existing = |name: &str| Some(run.join(name)).filter(|path| path.is_file());
        let tracks = existing("tracks.kitti.txt").map(|path| read_labels(&path)).transpose()?;
        let covariances = existing("ego_covariance.csv").map(|path| read_covariances(&path)).transpose()?;
        Ok(Self { ego: ego(run)?, covariances, tracks })
    }
}

/// Evaluates a run directory (`ego.kitti.txt` or `ego.tum`, and `tracks.kitti.txt` when there) against the KITTI
/// tracking split at `kitti_root` (`calib/`, `gt_poses/`, `label_02/`, and `label_03/` for camera 3). `first` is the
/// KITTI frame number of the run's first row.
///
/// # Errors
/// Files that do not read, and runs with another number of poses than the ground truth has frames.
pub fn evaluate_run(run: &Path, kitti_root: &Path, sequence: &str, camera: u8, first: u64) -> Result<Report> {
    evaluate_trajectories(&RunTrajectories::read(run)?, kitti_root, sequence, camera, first)
}

/// As [`evaluate_run`], for trajectories in memory.
///
/// # Errors
/// As [`evaluate_run`].
pub fn evaluate_trajectories(
    run: &RunTrajectories,
    kitti_root: &Path,
    sequence: &str,
    camera: u8,
    first: u64,
) -> Result<Report> {
    // The benchmark's own archive unpacks to a folder above.
    let inner = kitti_root.join("training");
    let root = if inner.join("calib").is_dir() { inner.as_path() } else { kitti_root };
    let file = |folder: &str| root.join(folder).join(format!("{sequence}.txt"));
    let calibration = file("calib");
    let camera_from_cam0 =
        KittiCalibration::read(&calibration)?.camera(&calibration, camera)?.camera_from_cam0;
    let truth = truth(&file("gt_poses"), camera_from_cam0, first, run.ego.len())?;
    let compared = Compared::new(&run.ego, &truth)?;

    let vehicles = if let Some(tracks) = &run.tracks {
        let labels = by_frame(read_labels(&file("label_02"))?.into_iter().filter(is_vehicle));
        let other = file("label_03");
        let moved = match camera {
            3 => Some(by_frame(read_labels(&other)?.into_iter().filter(is_vehicle))),
            _ => None,
        };
        let estimates = by_frame(tracks.iter().cloned());
        let boxes = moved.as_ref().unwrap_or(&labels);
        let drive = Vehicles {
            labels: &labels,
            boxes,
            estimates: &estimates,
            camera_from_cam0,
            first,
            range_m: RANGE_M,
        };
        Some(drive.evaluate(&compared))
    } else {
        None
    };
    Ok(Report {
        sequence: sequence.to_owned(),
        camera,
        first,
        ego: report(&compared),
        consistency: run.covariances.as_ref().and_then(|all| consistency(&compared, all)),
        vehicles_mean: vehicles.as_deref().and_then(means),
        vehicles,
        truth_path_m: compared.truth.iter().map(|pose| pose.translation().into()).collect(),
    })
}

fn is_vehicle(label: &Label) -> bool {
    !NO_VEHICLES.contains(&label.class.as_str())
}

fn ego(run: &Path) -> Result<Vec<Pose<World, Camera>>> {
    let names = ["ego.kitti.txt", "ego.tum"];
    let Some(path) = names.iter().map(|name| run.join(name)).find(|path| path.is_file()) else {
        let problem = "is no run directory: it holds neither ego.kitti.txt nor ego.tum".into();
        return Err(InputError::Input { path: run.to_path_buf(), problem }.into());
    };
    Ok(read_trajectory(&path)?.poses)
}

/// Poses of the processed camera for `count` frames from `first` on.
fn truth(
    path: &Path,
    camera_from_cam0: Pose<Camera, Cam0>,
    first: u64,
    count: usize,
) -> Result<Vec<Pose<World, Camera>>> {
    let world_from_cam0: Vec<Pose<World, Cam0>> = read_trajectory(path)?.poses;
    let cam0_from_camera = camera_from_cam0.inverse();
    let wanted: Vec<_> =
        world_from_cam0.iter().skip(first as usize).take(count).map(|p| *p * cam0_from_camera).collect();
    if wanted.len() == count {
        return Ok(wanted);
    }
    Err(Error::Mismatch(format!(
        "the run has {count} poses, but {} has {} from frame {first} on; give the number of the run's first frame",
        path.display(),
        wanted.len()
    )))
}
