//! One rendered frame.

use image::{GrayImage, ImageBuffer, Luma, RgbImage};

/// Colours and what lies behind them; all images have the camera's size.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// What the camera saw.
    pub rgb: RgbImage,
    /// Distance along the optical axis of the nearest surface \[m\], row by row; infinite for the sky.
    pub depth_m: Vec<f32>,
    /// 0 for the world, vehicle index + 1 otherwise.
    pub instance: ImageBuffer<Luma<u16>, Vec<u16>>,
    /// Share of carriageway in the pixel, 0 to 255.
    pub road: GrayImage,
    /// Seen extent of each vehicle.
    pub views: Vec<VehicleView>,
}

/// How much of a vehicle is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleView {
    /// Quarter pixels it covers in the picture.
    pub visible_samples: u64,
    /// Quarter pixels it would cover if nothing stood before it.
    pub own_samples: u64,
    /// x1, y1, x2, y2 of what is seen \[px\]; `None` when nothing is.
    pub visible_px: Option<[f64; 4]>,
}

impl VehicleView {
    /// Share of its in-image area that nothing hides, 0 to 1.
    pub fn visible_share(&self) -> f64 {
        self.visible_samples as f64 / self.own_samples.max(1) as f64
    }
}
