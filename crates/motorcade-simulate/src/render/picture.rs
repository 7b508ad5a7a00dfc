//! One rendered frame.

use image::{GrayImage, ImageBuffer, Luma, RgbImage};

/// Colours, depth and instances; all images have the camera's size.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Colour image.
    pub rgb: RgbImage,
    /// Distance along the optical axis of the nearest surface \[m\], row by row; infinite for the sky.
    pub depth_m: Vec<f32>,
    /// 0 for the world, vehicle index + 1 otherwise.
    pub instance: ImageBuffer<Luma<u16>, Vec<u16>>,
    /// Share of carriageway in the pixel, 0 to 255.
    pub road: GrayImage,
    /// Visible extent of each vehicle.
    pub views: Vec<VehicleView>,
}

/// Visibility of a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleView {
    /// Visible quarter pixels.
    pub visible_samples: u64,
    /// Quarter pixels without occlusion.
    pub own_samples: u64,
    /// x1, y1, x2, y2 of the visible part \[px\]; `None` when none is visible.
    pub visible_px: Option<[f64; 4]>,
}

impl VehicleView {
    /// Unoccluded share of its area in the image, 0 to 1.
    pub fn visible_share(&self) -> f64 {
        self.visible_samples as f64 / self.own_samples.max(1) as f64
    }
}
