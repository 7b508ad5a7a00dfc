//! Recognition of the kind of input at a path.

use std::path::Path;

use crate::error::{Error, Result};
use crate::regular_file::special_name;

use super::live_source::LiveSource;
use super::{Format, listing};

impl Format {
    /// Recognises the kind of input at a path.
    pub fn recognise(path: &Path) -> Result<Self> {
        if LiveSource::recognise(path).is_some() {
            return Ok(Self::Live);
        }
        let metadata = std::fs::metadata(path).map_err(Error::io(path))?;
        if metadata.is_file() {
            if listing::is_image(path) {
                return Err(Error::input(path, "is a single image; give the folder that holds the frames"));
            }
            return Ok(Self::Video);
        }
        if !metadata.is_dir() {
            let kind = special_name(metadata.file_type());
            return Err(Error::input(
                path,
                format!(
                    "is a {kind}; expected a folder, a video file or a camera (a V4L2 device such as /dev/video0); `-` reads a video from standard input"
                ),
            ));
        }
        for format in Self::ALL {
            if format.layout().recognises(path)? {
                return Ok(format);
            }
        }
        Err(Error::input(
            path,
            "holds no frames; expected image files (PNG, JPEG, WebP, BMP, TIFF), KITTI tracking (image_02/0000/), KITTI odometry (image_0/), \
             KITTI raw (image_02/data/), TUM (rgb.txt) or a video file",
        ))
    }
}
