//! Estimates of a run, from memory or from its directory.

use std::path::{Path, PathBuf};

use motorcade_dataset::text::TextFile;
use motorcade_dataset::{Error as InputError, Label, read_labels, read_trajectory, regular_file};
use motorcade_geometry::{Camera, Pose, World};
use nalgebra::Matrix6;

use crate::deviations::{VehicleDeviations, parse_deviations, read_deviations};
use crate::error::Result;

/// Estimates of a run, one row a frame.
#[derive(Clone, Debug, Default)]
pub struct Estimates {
    /// Camera poses \[m\]; the world is arbitrary.
    pub world_from_camera: Vec<Pose<World, Camera>>,
    /// Covariances of the poses (6×6 `[ω, ν]`, right perturbation), when the run has them.
    pub covariances: Option<Vec<Matrix6<f64>>>,
    /// Vehicles as KITTI tracking results, when the run has them. Frames are the input's own numbers, or rows of the run.
    pub tracks: Option<Vec<Label>>,
    /// Standard deviations of these vehicles, when the run has them.
    pub deviations: Option<Vec<VehicleDeviations>>,
}

impl Estimates {
    /// Reads a run directory: `ego.kitti.txt` or `ego.tum`, and `ego_covariance.csv`, `tracks.kitti.txt` and `tracks.csv`
    /// where they exist.
    ///
    /// # Errors
    /// A directory without a trajectory, a file that does not read, and anything but a regular file under one of these names.
    pub fn read(directory: &Path) -> Result<Self> {
        let existing = |name: &str| -> Result<Option<PathBuf>> {
            let path = directory.join(name);
            match regular_file::exists(&path) {
                Ok(there) => Ok(there.then_some(path)),
                Err(source) => Err(InputError::Io { path, source }.into()),
            }
        };
        let (kitti, tum) = (existing("ego.kitti.txt")?, existing("ego.tum")?);
        let Some(ego) = kitti.or(tum) else {
            let problem = "is no run directory: it holds neither ego.kitti.txt nor ego.tum".into();
            return Err(InputError::Input { path: directory.to_path_buf(), problem }.into());
        };
        Ok(Self {
            world_from_camera: read_trajectory(&ego)?.poses,
            covariances: existing("ego_covariance.csv")?.map(|path| read_covariances(&path)).transpose()?,
            tracks: existing("tracks.kitti.txt")?.map(|path| read_labels(&path)).transpose()?,
            deviations: existing("tracks.csv")?.map(|path| read_deviations(&path)).transpose()?.flatten(),
        })
    }

    /// Takes the deviations of a `tracks.csv` in memory.
    ///
    /// # Errors
    /// A row that does not read.
    pub fn with_track_table(self, table: &[u8]) -> Result<Self> {
        Ok(Self { deviations: parse_deviations(Path::new("tracks.csv"), table)?, ..self })
    }
}

/// Reads `ego_covariance.csv`: a header, then the frame and the 21 numbers of the upper triangle, row by row.
fn read_covariances(path: &Path) -> Result<Vec<Matrix6<f64>>> {
    let file = TextFile::read(path)?;
    let mut out = Vec::new();
    for row in file.comma_rows().skip(1) {
        row.require_columns(&[22], "the frame and 21 numbers of the upper triangle")?;
        let numbers: [f64; 21] = row.numbers(1, "a number of the covariance")?;
        let mut covariance = Matrix6::zeros();
        let entries = (0..6).flat_map(|r| (r..6).map(move |c| (r, c)));
        for ((r, c), value) in entries.zip(numbers) {
            covariance[(r, c)] = value;
            covariance[(c, r)] = value;
        }
        out.push(covariance);
    }
    Ok(out)
}
