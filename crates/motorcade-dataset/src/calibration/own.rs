//! The project's own TOML format: flat; unknown fields are an error.
//!
//! ```toml
//! fx = 721.5377      # px
//! fy = 721.5377      # px
//! cx = 609.5593      # px, pixel centres at integer coordinates
//! cy = 172.854       # px
//! width = 1242       # px, optional: checked against the frames
//! height = 375       # px, optional
//! fps = 10.0         # optional
//! height_m = 1.65    # camera above the road, optional
//!
//! [distortion]       # radial-tangential, optional, each field optional
//! k1 = 0.0
//! k2 = 0.0
//! p1 = 0.0
//! p2 = 0.0
//! k3 = 0.0
//! ```

use std::path::Path;

use motorcade_geometry::{Distortion, Pose};

use super::Calibration;
use crate::error::{Error, Result};

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    width: Option<u32>,
    height: Option<u32>,
    fps: Option<f64>,
    height_m: Option<f64>,
    #[serde(default)]
    distortion: Lens,
}

#[derive(Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Lens {
    k1: f64,
    k2: f64,
    p1: f64,
    p2: f64,
    k3: f64,
}

pub(super) fn parse(path: &Path, text: &str) -> Result<Calibration> {
    let file: File =
        toml::from_str(text).map_err(|e| Error::input(path, format!("not a calibration: {e}")))?;
    let size = match (file.width, file.height) {
        (Some(width), Some(height)) => Some((width, height)),
        (None, None) => None,
        _ => return Err(Error::input(path, "give both width and height, or neither")),
    };
    let Lens { k1, k2, p1, p2, k3 } = file.distortion;
    Ok(Calibration {
        dialect: "motorcade TOML",
        fx: file.fx,
        fy: file.fy,
        cx: file.cx,
        cy: file.cy,
        size,
        distortion: Distortion { k1, k2, p1, p2, k3 },
        fps: file.fps,
        height_m: file.height_m,
        camera_from_cam0: Pose::identity(),
    })
}
