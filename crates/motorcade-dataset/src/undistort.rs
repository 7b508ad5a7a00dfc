//! Undistortion of frames by a remap table computed once.

use image::{GrayImage, RgbImage};
use motorcade_geometry::{DistortedCamera, PinholeCamera};
use rayon::prelude::*;

use crate::frame::Pixels;

/// Remap table from the pixels of a pinhole camera to those of a camera with a lens, both of one image size.
#[derive(Clone, Debug)]
pub struct Undistortion {
    width: u32,
    height: u32,
    /// Source pixel of each target pixel; NaN outside the source.
    source: Vec<[f32; 2]>,
}

impl Undistortion {
    /// Computes the table from frames of `camera` to those of `pinhole`.
    pub fn new(camera: &DistortedCamera, pinhole: &PinholeCamera) -> Self {
        let (width, height) = (pinhole.width, pinhole.height);
        let from = camera.matrix();
        let (last_x, last_y) = (f64::from(from.width - 1), f64::from(from.height - 1));
        let inside = move |u: f64, v: f64| u >= 0.0 && v >= 0.0 && u <= last_x && v <= last_y;
        let rows = (0..height).into_par_iter().flat_map_iter(|y| {
            (0..width).map(move |x| {
                let ray = pinhole.ray(&[f64::from(x), f64::from(y)].into());
                match camera.pixel(ray.x, ray.y) {
                    Some(p) if inside(p.x, p.y) => [p.x as f32, p.y as f32],
                    _ => [f32::NAN; 2],
                }
            })
        });
        Self { width, height, source: rows.collect() }
    }

    /// Undistorts a frame of the table's size, bilinear; black outside the source.
    pub fn pixels(&self, pixels: &Pixels) -> Pixels {
        match pixels {
            Pixels::Gray(image) => {
                let mut to = GrayImage::new(self.width, self.height);
                self.remap::<1>(image, &mut to);
                Pixels::Gray(to)
            }
            Pixels::Rgb(image) => {
                let mut to = RgbImage::new(self.width, self.height);
                self.remap::<3>(image, &mut to);
                Pixels::Rgb(to)
            }
        }
    }

    /// Undistorts an ignore mask: nearest pixel, and pixels without a source are ignored too. `None` when no pixel is.
    pub fn mask(&self, mask: Option<&GrayImage>) -> Option<GrayImage> {
        let mut to = GrayImage::new(self.width, self.height);
        let mut any = false;
        for (to, [u, v]) in to.pixels_mut().zip(&self.source) {
            let value = if u.is_nan() {
                255
            } else {
                mask.map_or(0, |mask| mask.get_pixel(u.round() as u32, v.round() as u32).0[0])
            };
            any |= value != 0;
            to.0 = [value];
        }
        any.then_some(to)
    }

    fn remap<const CHANNELS: usize>(&self, from: &[u8], to: &mut [u8]) {
        let width = self.width as usize;
        let (last_x, last_y) = (width - 1, self.height as usize - 1);
        let rows = to.par_chunks_mut(width * CHANNELS).zip(self.source.par_chunks(width));
        rows.for_each(|(row, sources)| {
            for (pixel, [u, v]) in row.chunks_exact_mut(CHANNELS).zip(sources) {
                if u.is_nan() {
                    continue;
                }
                let (x, y) = (*u as usize, *v as usize);
                let (fx, fy) = (u - x as f32, v - y as f32);
                let (right, below) = ((x + 1).min(last_x), (y + 1).min(last_y));
                for (c, value) in pixel.iter_mut().enumerate() {
                    let at = |x: usize, y: usize| f32::from(from[(y * width + x) * CHANNELS + c]);
                    let top = at(x, y) * (1.0 - fx) + at(right, y) * fx;
                    let bottom = at(x, below) * (1.0 - fx) + at(right, below) * fx;
                    *value = (top * (1.0 - fy) + bottom * fy + 0.5) as u8;
                }
            }
        });
    }
}

#[cfg(test)]
#[path = "undistort_tests.rs"]
mod tests;
