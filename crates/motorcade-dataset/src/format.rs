//! Kinds of input.

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
    /// A folder of numbered image files (PNG, JPEG, WebP, BMP, TIFF).
    Images,
    /// A video file, read through the `ffmpeg` program.
    Video,
    /// Standard input (`-`), a stream of the network or a camera, read through the `ffmpeg` program as it comes.
    Live,
}

impl Format {
    /// All formats, in the order in which they are tried.
    pub const ALL: [Self; 6] =
        [Self::KittiTracking, Self::KittiOdometry, Self::KittiRaw, Self::Images, Self::Video, Self::Live];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::KittiTracking => "kitti-tracking",
            Self::KittiOdometry => "kitti-odometry",
            Self::KittiRaw => "kitti-raw",
            Self::Images => "images",
            Self::Video => "video",
            Self::Live => "live",
        }
    }

    /// True for recordings of the KITTI car, whose camera stands 1.65 m above the road.
    pub fn is_kitti(self) -> bool {
        matches!(self, Self::KittiTracking | Self::KittiOdometry | Self::KittiRaw)
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
