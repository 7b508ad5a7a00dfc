//! Calibration files of several formats.

mod document;
mod identity;
mod kalibr;
mod kitti;
mod model;
mod opencv;
mod orb_slam;
mod own;
mod yaml;
mod yaml_camera;
mod yaml_file;

use std::path::Path;

use motorcade_geometry::{Camera, DistortedCamera, Distortion, Frame, PinholeCamera, Pose};

use crate::error::{Error, Result};
use crate::text::TextFile;

pub use kitti::KittiCalibration;

/// The rectified left grey camera of a KITTI rig, in which its labels and poses are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cam0;

impl Frame for Cam0 {
    const NAME: &'static str = "cam0";
}

/// A camera as described by its file: that of the frames as they come in. The image size may be unknown until the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Format of the file.
    pub dialect: &'static str,
    /// Focal length along x \[px\].
    pub fx: f64,
    /// Focal length along y \[px\].
    pub fy: f64,
    /// Principal point x \[px\].
    pub cx: f64,
    /// Principal point y \[px\].
    pub cy: f64,
    /// Image width and height \[px\], when the file has it.
    pub size: Option<(u32, u32)>,
    /// Lens distortion.
    pub distortion: Distortion,
    /// Horizontal view of the undistorted frames \[°\], when the file states it.
    pub view_deg: Option<f64>,
    /// Frames per second, when the file has it.
    pub fps: Option<f64>,
    /// Height of the camera above the road \[m\], when the file has it.
    pub height_m: Option<f64>,
    /// Time from the reading of the first row to that of the last \[ms\]; 0 for a global shutter.
    pub readout_ms: f64,
    /// Standard deviation of the logarithm of the focal length, when the file has it.
    pub focal_sigma: Option<f64>,
    /// `camera_from_cam0` of a KITTI rig; the identity elsewhere.
    pub camera_from_cam0: Pose<Camera, Cam0>,
}

/// Horizontal views of a pinhole that can be stated \[°\].
const VIEW_RANGE_DEG: std::ops::RangeInclusive<f64> = 1.0..=170.0;
/// Times in which the rows of a picture are read \[ms\].
pub(crate) const READOUT_RANGE_MS: std::ops::RangeInclusive<f64> = 0.0..=200.0;
/// Frames per second that there can be.
pub(crate) const FPS_RANGE: std::ops::RangeInclusive<f64> = 0.01..=1e4;
/// Heights of a camera above the road \[m\] beyond which numbers lose their meaning.
pub const HEIGHT_RANGE_M: std::ops::RangeInclusive<f64> = 0.01..=1e3;

impl Calibration {
    /// Reads a file of any supported format, recognised by its content. `camera` chooses among a KITTI file's `P0`..`P3`
    /// and a Kalibr file's `cam0`, `cam1`...
    pub fn read(path: &Path, camera: Option<u8>) -> Result<Self> {
        let file = TextFile::read(path)?;
        let text = file.text().trim_start_matches('\u{feff}').trim_start();
        let calibration = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            own::parse(path, text)?
        } else if kitti::looks_like(text) {
            KittiCalibration::parse(path, &file)?.camera(path, camera.unwrap_or(0))?
        } else if text.starts_with("%YAML") || text.lines().any(|l| l.contains(':')) {
            yaml_file::parse(path, &file, camera)?
        } else {
            own::parse(path, text)?
        };
        calibration.check(path)?;
        Ok(calibration)
    }

    /// The pinhole camera of the undistorted frames, for frames of this size; an error when the file is for another size.
    pub fn pinhole(&self, path: &Path, width: u32, height: u32) -> Result<PinholeCamera> {
        let view_rad = self.view_deg.map(f64::to_radians);
        let pinhole = self.distorted(path, width, height)?.undistorted(view_rad);
        pinhole.map_err(|e| Error::input(path, e.to_string()))
    }

    /// The camera of the frames as they come in, for frames of this size; an error when the file is for another size.
    pub fn distorted(&self, path: &Path, width: u32, height: u32) -> Result<DistortedCamera> {
        if let Some((found_width, found_height)) = self.size.filter(|size| *size != (width, height)) {
            return Err(Error::Size {
                path: path.to_path_buf(),
                what: "calibration",
                found_width,
                found_height,
                against: "the first frame",
                width,
                height,
                advice: "use the calibration made at this resolution, or scale the frames",
            });
        }
        let matrix = PinholeCamera { fx: self.fx, fy: self.fy, cx: self.cx, cy: self.cy, width, height };
        DistortedCamera::new(matrix, self.distortion).map_err(|e| Error::input(path, e.to_string()))
    }

    /// Checks that do not need the image size.
    fn check(&self, path: &Path) -> Result<()> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !(positive(self.fx) && positive(self.fy)) {
            return Err(Error::input(
                path,
                format!("focal lengths must be positive, got {} {}", self.fx, self.fy),
            ));
        }
        // Outside the image, the message names the image's size beside the principal point.
        for (name, value) in [("cx", self.cx), ("cy", self.cy)] {
            if !value.is_finite() {
                return Err(Error::input(path, format!("{name} = {value:e} must be finite")));
            }
        }
        self.distortion.validate().map_err(|e| Error::input(path, e.to_string()))?;
        if let Some(view) = self.view_deg.filter(|view| !VIEW_RANGE_DEG.contains(view)) {
            return Err(Error::input(path, format!("view_deg = {view:e} must lie in [1, 170] degrees")));
        }
        if let Some(fps) = self.fps.filter(|fps| !FPS_RANGE.contains(fps)) {
            return Err(Error::input(path, format!("fps = {fps:e} must lie in [0.01, 10000]")));
        }
        if let Some(sigma) = self.focal_sigma.filter(|sigma| !(0.0..=1.0).contains(sigma)) {
            return Err(Error::input(
                path,
                format!("focal_px = {:e} of [sigma] must lie in [0, fx]", sigma * self.fx),
            ));
        }
        if let Some(height) = self.height_m.filter(|height| !HEIGHT_RANGE_M.contains(height)) {
            return Err(Error::input(path, format!("height_m = {height:e} must lie in [0.01, 1000] m")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod lens_tests;
#[cfg(test)]
mod tests;
