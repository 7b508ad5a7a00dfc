//! Kinds of input and their frames.

pub(crate) mod decode;
mod images;
mod kitti;
mod layout;
pub(crate) mod listing;
pub(crate) mod live;
mod live_source;
mod recognise;
mod slot;
mod tum;
pub(crate) mod video;

pub use decode::IMAGE_ENDINGS;
pub(crate) use layout::{Choice, Contents, Layout};
pub(crate) use live_source::LiveSource;
pub(crate) use slot::{Slot, Store};

use crate::error::{Error, Result};

/// A kind of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// A split of KITTI tracking: `image_02/0005/000000.png`, `calib/0005.txt`.
    KittiTracking,
    /// A sequence of KITTI odometry: `image_0/000000.png`, `calib.txt`, `times.txt`.
    KittiOdometry,
    /// A drive of KITTI raw: `image_02/data/0000000000.png`, `image_02/timestamps.txt`.
    KittiRaw,
    /// A sequence in the layout of the TUM RGB-D benchmark: `rgb.txt` with a time \[s\] and a picture's path a line.
    Tum,
    /// A folder of numbered image files (PNG, JPEG, WebP, BMP, TIFF).
    Images,
    /// A video file, read through the `ffmpeg` program.
    Video,
    /// Standard input (`-`), a stream of the network or a camera, read through the `ffmpeg` program as it comes.
    Live,
}

impl Format {
    /// All formats, in the order in which they are tried.
    pub const ALL: [Self; 7] = [
        Self::KittiRaw,
        Self::KittiTracking,
        Self::KittiOdometry,
        Self::Tum,
        Self::Images,
        Self::Video,
        Self::Live,
    ];

    /// The reader of this kind of input.
    pub(crate) fn layout(self) -> &'static dyn Layout {
        match self {
            Self::KittiRaw => &kitti::Raw,
            Self::KittiTracking => &kitti::Tracking,
            Self::KittiOdometry => &kitti::Odometry,
            Self::Tum => &tum::Tum,
            Self::Images => &images::Images,
            Self::Video => &video::Video,
            Self::Live => &live::LiveInput,
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.layout().name()
    }

    /// True for recordings of the KITTI car, whose camera stands 1.65 m above the road.
    pub fn is_kitti(self) -> bool {
        self.layout().is_kitti()
    }
}

impl std::str::FromStr for Format {
    type Err = Error;
    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|format| format.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.into_iter().map(Self::name).collect();
            Error::Usage(format!("unknown format `{text}`; one of {}", names.join(", ")))
        })
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
