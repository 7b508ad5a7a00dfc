//! Pixels to ignore: a bonnet, burnt-in text, drawings.

use std::path::{Path, PathBuf};

use image::GrayImage;

use crate::error::{Error, Result};
use crate::source::{decode, listing};

/// Masks of a drive: one for all frames, or one a frame number. Nonzero = ignore.
#[derive(Clone, Debug)]
pub(crate) enum IgnoreMasks {
    All(PathBuf, GrayImage),
    Numbered(Vec<(u64, PathBuf)>),
}

impl IgnoreMasks {
    /// A file, or a folder with one image, is the mask of all frames; otherwise the number in the name is the frame's.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        if path.is_file() {
            return Ok(Self::All(path.to_path_buf(), decode::read_mask(path)?));
        }
        let listing = listing::list(path)?;
        match listing.entries.as_slice() {
            [] => Err(Error::input(
                path,
                "holds no masks; expected PNG files named by frame number, or one for all",
            )),
            [only] => Ok(Self::All(only.path.clone(), decode::read_mask(&only.path)?)),
            many => Ok(Self::Numbered(many.iter().map(|entry| (entry.number, entry.path.clone())).collect())),
        }
    }

    /// The mask of a frame of this size.
    pub(crate) fn get(&self, number: u64, size: (u32, u32)) -> Result<Option<GrayImage>> {
        let (path, mask) = match self {
            Self::All(path, mask) => (path, mask.clone()),
            Self::Numbered(masks) => {
                let Ok(i) = masks.binary_search_by_key(&number, |(number, _)| *number) else {
                    return Ok(None);
                };
                (&masks[i].1, decode::read_mask(&masks[i].1)?)
            }
        };
        if mask.dimensions() == size {
            return Ok(Some(mask));
        }
        Err(Error::Size {
            path: path.clone(),
            what: "ignore mask",
            found_width: mask.width(),
            found_height: mask.height(),
            against: "its frame",
            width: size.0,
            height: size.1,
            advice: "masks are drawn on the frames as they come in",
        })
    }

    /// Adds the content that identifies the masks to a fingerprint.
    pub(crate) fn describe(&self, add: &mut dyn FnMut(&[u8])) {
        match self {
            Self::All(_, mask) => add(mask.as_raw()),
            Self::Numbered(masks) => {
                for (number, path) in masks {
                    add(&number.to_le_bytes());
                    add(&std::fs::metadata(path).map_or(0, |m| m.len()).to_le_bytes());
                }
            }
        }
    }
}

/// Images of a folder by the number in their names, in order; of duplicate numbers the first name counts.
pub fn numbered_images(folder: &Path) -> Result<Vec<(u64, PathBuf)>> {
    Ok(listing::list(folder)?.entries.into_iter().map(|entry| (entry.number, entry.path)).collect())
}

/// Reads an image as a mask: pixels that are not black are nonzero.
pub fn read_mask(path: &Path) -> Result<GrayImage> {
    decode::read_mask(path)
}
