//! Road masks as images, one a frame.

use std::path::{Path, PathBuf};

use motorcade_dataset::{Frame, numbered_images, read_mask};

use crate::detectors::RoadSegmenter;
use crate::error::Result;
use crate::road::RoadMask;

/// A folder with one image a frame number; values are probabilities of road, 0 to 255.
///
/// Masks of 0 and 1 are read as such too: their 1 means road.
#[derive(Clone, Debug)]
pub struct RoadMaskFolder {
    files: Vec<(u64, PathBuf)>,
}

impl RoadMaskFolder {
    /// Lists a folder.
    pub fn open(folder: &Path) -> Result<Self> {
        let files = numbered_images(folder)?;
        if files.is_empty() {
            return Err(motorcade_dataset::Error::Input {
                path: folder.to_path_buf(),
                problem: "holds no road masks; expected PNG files named by frame number".into(),
            }
            .into());
        }
        Ok(Self { files })
    }

    /// The mask of a frame; `None` when the folder has none for it. Any resolution is scaled to the frame's.
    pub fn of_frame(&self, number: u64, (width, height): (u32, u32)) -> Result<Option<RoadMask>> {
        let Ok(i) = self.files.binary_search_by_key(&number, |(number, _)| *number) else { return Ok(None) };
        let mut mask = read_mask(&self.files[i].1)?;
        if mask.pixels().all(|p| p.0[0] <= 1) {
            mask.pixels_mut().for_each(|p| p.0[0] *= 255);
        }
        Ok(Some(RoadMask::new(mask, width, height)))
    }
}

impl RoadSegmenter for RoadMaskFolder {
    fn segment(&mut self, frame: &Frame) -> Result<Option<RoadMask>> {
        self.of_frame(frame.number, frame.size())
    }
    fn description(&self) -> String {
        "mask files".to_owned()
    }
}
