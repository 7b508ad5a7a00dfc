//! Interface of a kind of input.

use std::path::{Path, PathBuf};

use super::listing::{Listing, list};
use super::slot::Store;
use crate::error::{Error, Result};

/// The part of an input that is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Choice<'a> {
    /// Sequence of a dataset; the only one when absent.
    pub sequence: Option<&'a str>,
    /// Camera of a rig.
    pub camera: Option<u8>,
}

/// A kind of input: its name, how it is recognised, and where its frames, times and calibration are.
pub(crate) trait Layout: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;

    /// True when a folder holds this kind of input, by the names in it. Files and streams are recognised elsewhere.
    fn recognises(&self, folder: &Path) -> Result<bool>;

    /// Frames, times and calibration of an input, before any pixel is read.
    fn contents(&self, root: &Path, choice: Choice<'_>) -> Result<Contents>;

    /// True for recordings of the KITTI car: the height of its camera is known, and frames are counted from the start of a recording.
    fn is_kitti(&self) -> bool {
        false
    }
}

/// Frames, times and calibration of an input.
#[derive(Clone, Debug)]
pub(crate) struct Contents {
    pub store: Store,
    /// The input's own calibration file.
    pub calibration: Option<PathBuf>,
    /// Camera of a rig.
    pub camera: Option<u8>,
    /// Sequence of a dataset.
    pub sequence: Option<String>,
    /// Image files; none for videos and live sources.
    pub listing: Listing,
    /// Time of each frame by its number \[ns\]; `None` where the input has no times.
    pub times_ns: Option<Vec<i64>>,
    /// Frame rate of a video \[1/s\].
    pub video_fps: Option<f64>,
    /// Turn to the left by which a video asks to be shown, which is applied \[°\].
    pub rotation_deg: Option<i32>,
    /// Frames of a video.
    pub video_frames: u64,
}

impl Contents {
    /// Pixels in a store that has no image files.
    pub(crate) fn stored(store: Store) -> Self {
        Self {
            store,
            calibration: None,
            camera: None,
            sequence: None,
            listing: Listing::default(),
            times_ns: None,
            rotation_deg: None,
            video_fps: None,
            video_frames: 0,
        }
    }

    /// Image files that were listed.
    pub(crate) fn listed(listing: Listing) -> Self {
        Self { listing, ..Self::stored(Store::Files) }
    }

    /// The numbered image files of a folder.
    ///
    /// # Errors
    /// A folder without any.
    pub(crate) fn of_folder(folder: &Path) -> Result<Self> {
        let listing = list(folder)?;
        if listing.entries.is_empty() {
            return Err(Error::input(
                folder,
                "holds no frames; expected numbered image files (PNG, JPEG, WebP, BMP, TIFF)",
            ));
        }
        Ok(Self::listed(listing))
    }
}
