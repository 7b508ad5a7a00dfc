//! Recognition of the kind of input at a path.

use std::path::Path;

use crate::error::{Error, Result};
use crate::format::Format;
use crate::regular_file::special_name;
use crate::source::images;
use crate::source::live::LiveSource;

impl Format {
    /// Recognises the kind of input at a path.
    pub fn recognise(path: &Path) -> Result<Self> {
        if LiveSource::recognise(path).is_some() {
            return Ok(Self::Live);
        }
        let metadata = std::fs::metadata(path).map_err(Error::io(path))?;
        if metadata.is_file() {
            if images::is_image(path) {
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
        let has = |name: &str| path.join(name).is_dir();
        if (0..4).any(|camera| path.join(format!("image_{camera:02}/data")).is_dir()) {
            return Ok(Self::KittiRaw);
        }
        if has("image_02") || has("image_03") {
            return Ok(Self::KittiTracking);
        }
        if (0..4).any(|camera| has(&format!("image_{camera}"))) {
            return Ok(Self::KittiOdometry);
        }
        if !images::list(path)?.entries.is_empty() {
            return Ok(Self::Images);
        }
        Err(Error::input(
            path,
            "holds no frames; expected image files (PNG, JPEG, WebP, BMP, TIFF), KITTI tracking (image_02/0000/), KITTI odometry (image_0/), \
             KITTI raw (image_02/data/) or a video file",
        ))
    }
}
