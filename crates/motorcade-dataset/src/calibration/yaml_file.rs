//! YAML calibrations: OpenCV and ORB-SLAM (`%YAML:1.0`), ROS `camera_info`, Kalibr.

use std::path::Path;

use motorcade_geometry::Pose;

use super::document::Document;
use super::{Calibration, kalibr, opencv, orb_slam};
use crate::error::{Error, Result};
use crate::text::TextFile;

pub(super) fn parse(path: &Path, file: &TextFile, camera: Option<u8>) -> Result<Calibration> {
    let document = Document::new(path, file.text());
    let found = match orb_slam::parse(&document)? {
        Some(found) => Some(found),
        None => opencv::parse(&document)?,
    };
    let found = match found {
        Some(found) => found,
        None => kalibr::parse(&document, camera)?.ok_or_else(|| {
            Error::input(
                path,
                "no calibration found; expected Camera.fx .. (ORB-SLAM), camera_matrix (OpenCV, ROS camera_info), \
                 cam0: .. intrinsics (Kalibr), P0: .. P3: (KITTI) or fx = .. (our TOML, in a file ending in .toml)",
            )
        })?,
    };
    let [fx, fy, cx, cy] = found.intrinsics;
    let width = document.number(&["image_width", "Camera.width", "width", "imageWidth"])?;
    let height = document.number(&["image_height", "Camera.height", "height", "imageHeight"])?;
    let size = found.size.or(width.zip(height).map(<[f64; 2]>::from));
    Ok(Calibration {
        dialect: found.dialect,
        fx,
        fy,
        cx,
        cy,
        size: size.map(|[w, h]| (w as u32, h as u32)),
        distortion: found.distortion,
        view_deg: None,
        fps: found.fps.or(document.number(&["Camera.fps", "fps"])?),
        height_m: None,
        readout_ms: 0.0,
        focal_sigma: None,
        camera_from_cam0: Pose::identity(),
    })
}
