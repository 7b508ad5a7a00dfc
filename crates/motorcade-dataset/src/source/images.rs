//! Folders of numbered images.

use std::path::{Path, PathBuf};

use super::layout::{Choice, Contents, Layout};
use super::listing::list;
use crate::error::Result;

/// File names beside the frames that are used as their calibration.
const CALIBRATION_NAMES: [&str; 5] =
    ["calibration.toml", "calib.txt", "camera.yaml", "camera_info.yaml", "calibration.yaml"];

/// A folder of numbered image files.
pub(crate) struct Images;

impl Layout for Images {
    fn name(&self) -> &'static str {
        "images"
    }

    fn recognises(&self, folder: &Path) -> Result<bool> {
        Ok(!list(folder)?.entries.is_empty())
    }

    fn contents(&self, root: &Path, _: Choice<'_>) -> Result<Contents> {
        let mut contents = Contents::of_folder(root)?;
        contents.calibration = calibration_beside(root);
        Ok(contents)
    }
}

/// The calibration file in the folder of the frames.
pub(super) fn calibration_beside(folder: &Path) -> Option<PathBuf> {
    CALIBRATION_NAMES.iter().map(|name| folder.join(name)).find(|path| path.is_file())
}
