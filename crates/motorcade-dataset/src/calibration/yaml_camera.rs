//! What a dialect of YAML says about a camera.

use motorcade_geometry::Distortion;

/// What one of the dialects says.
pub(super) struct YamlCamera {
    pub dialect: &'static str,
    /// fx, fy, cx, cy \[px\].
    pub intrinsics: [f64; 4],
    pub distortion: Distortion,
    /// Width and height \[px\], where the dialect has keys of its own.
    pub size: Option<[f64; 2]>,
    /// Frames per second, where the dialect has a key of its own.
    pub fps: Option<f64>,
}

impl YamlCamera {
    pub(super) fn new(dialect: &'static str, intrinsics: [f64; 4], distortion: Distortion) -> Self {
        Self { dialect, intrinsics, distortion, size: None, fps: None }
    }
}
