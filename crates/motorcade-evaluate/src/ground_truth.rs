//! Ground truth of a KITTI tracking sequence.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_dataset::{Cam0, KittiCalibration, Label, read_labels, read_trajectory};
use motorcade_geometry::{Camera, Pose, World};

use crate::error::{Error, Result};
use crate::matching::{ByFrame, by_frame};

/// Labelled classes that are not vehicles of a class we estimate.
const OTHER_CLASSES: [&str; 7] =
    ["DontCare", "Pedestrian", "Cyclist", "Person", "Person_sitting", "Misc", "Tram"];

/// Frames per second of KITTI.
const KITTI_FPS: f64 = 10.0;

/// Poses of a camera of a KITTI tracking sequence, and the labelled vehicles.
#[derive(Clone, Debug)]
pub struct GroundTruth {
    pub(crate) sequence: String,
    pub(crate) camera: u8,
    /// KITTI frame number of the run's row 0.
    pub(crate) first: u64,
    pub(crate) fps: f64,
    /// Of the processed camera, from `first` on.
    pub(crate) world_from_camera: Vec<Pose<World, Camera>>,
    pub(crate) camera_from_cam0: Pose<Camera, Cam0>,
    /// Labels of camera 2: positions and sizes; `None` for sequences without labels.
    pub(crate) labels: Option<ByFrame>,
    /// The same vehicles with their boxes in the processed camera, when that is not camera 2.
    pub(crate) moved: Option<ByFrame>,
    /// Labels of all kinds with their boxes in the processed camera, from `first` on; `None` where that camera has none.
    pub(crate) all: Option<BTreeMap<u64, Vec<Label>>>,
}

impl GroundTruth {
    /// Reads a sequence of the tracking split at `kitti_root` (`calib/`, `gt_poses/`; where they exist `label_02/`, and
    /// `label_03/` for camera 3); `first` is the KITTI frame number of the run's first row.
    ///
    /// # Errors
    /// Files that do not read.
    pub fn read_kitti(kitti_root: &Path, sequence: &str, camera: u8, first: u64) -> Result<Self> {
        // The benchmark's own archive unpacks to a folder above.
        let inner = kitti_root.join("training");
        let root = if inner.join("calib").is_dir() { inner.as_path() } else { kitti_root };
        let file = |folder: &str| root.join(folder).join(format!("{sequence}.txt"));
        let calibration = file("calib");
        let camera_from_cam0 =
            KittiCalibration::read(&calibration)?.camera(&calibration, camera)?.camera_from_cam0;
        let world_from_cam0: Vec<Pose<World, Cam0>> = read_trajectory(&file("gt_poses"))?.poses;
        let cam0_from_camera = camera_from_cam0.inverse();
        let vehicles = |path: &Path| -> Result<ByFrame> {
            let of_vehicle = |label: &Label| !OTHER_CLASSES.contains(&label.class.as_str());
            Ok(by_frame(read_labels(path)?.into_iter().filter(of_vehicle)))
        };
        let shown = file(&format!("label_{camera:02}"));
        let all = |path: &Path| -> Result<BTreeMap<u64, Vec<Label>>> {
            let mut frames = BTreeMap::<u64, Vec<Label>>::new();
            for label in read_labels(path)?.into_iter().filter(|label| label.frame >= first) {
                frames.entry(label.frame).or_default().push(label);
            }
            Ok(frames)
        };
        let skipped = usize::try_from(first).unwrap_or(usize::MAX);
        Ok(Self {
            sequence: sequence.to_owned(),
            camera,
            first,
            fps: KITTI_FPS,
            world_from_camera: world_from_cam0.iter().skip(skipped).map(|p| *p * cam0_from_camera).collect(),
            camera_from_cam0,
            labels: Some(file("label_02")).filter(|path| path.is_file()).map(|p| vehicles(&p)).transpose()?,
            moved: Some(file("label_03"))
                .filter(|path| camera == 3 && path.is_file())
                .map(|p| vehicles(&p))
                .transpose()?,
            all: Some(shown).filter(|path| path.is_file()).map(|p| all(&p)).transpose()?,
        })
    }

    /// Takes a drive in KITTI's format for one with `fps` frames a second.
    #[must_use]
    pub fn with_fps(self, fps: f64) -> Self {
        Self { fps, ..self }
    }

    /// The first `count` poses.
    pub(crate) fn poses(&self, count: usize) -> Result<&[Pose<World, Camera>]> {
        self.world_from_camera.get(..count).ok_or_else(|| {
            Error::Mismatch(format!(
                "the run has {count} poses, but the ground truth of sequence {} has {} from frame {} on; give the number of the \
                 run's first frame",
                self.sequence,
                self.world_from_camera.len(),
                self.first,
            ))
        })
    }
}
