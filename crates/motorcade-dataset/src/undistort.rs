//! Undistortion of frames by a remap table computed once.

use image::{GrayImage, RgbImage};
use motorcade_geometry::{Distortion, PinholeCamera};
use rayon::prelude::*;

use crate::frame::Pixels;

/// Remap table from undistorted to distorted pixels. The camera matrix stays the same.
#[derive(Clone, Debug)]
pub struct Undistortion {
    width: u32,
    height: u32,
    /// Source pixel of each target pixel; NaN outside the source.
    source: Vec<[f32; 2]>,
}

impl Undistortion {
    /// Computes the table.
    pub fn new(camera: &PinholeCamera, distortion: &Distortion) -> Self {
        let (width, height) = (camera.width, camera.height);
        let rows = (0..height).into_par_iter().flat_map_iter(|y| {
            (0..width).map(move |x| {
                let ray = camera.ray(&[f64::from(x), f64::from(y)].into());
                let (dx, dy) = distortion.distort(ray.x, ray.y);
                let (u, v) = (dx * camera.fx + camera.cx, dy * camera.fy + camera.cy);
                let inside = u >= 0.0 && v >= 0.0 && u <= f64::from(width - 1) && v <= f64::from(height - 1);
                if inside { [u as f32, v as f32] } else { [f32::NAN; 2] }
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
mod tests {
    use super::*;

    fn camera() -> PinholeCamera {
        PinholeCamera { fx: 60.0, fy: 60.0, cx: 39.5, cy: 29.5, width: 80, height: 60 }
    }

    #[test]
    fn a_distorted_ramp_becomes_straight_again() {
        let distortion = Distortion { k1: -0.2, k2: 0.05, p1: 0.001, p2: -0.002, k3: 0.0 };
        // Value of a pixel = 2 x its undistorted column, found by inverting the model by fixed point.
        let raw = GrayImage::from_fn(80, 60, |x, y| {
            let (u, v) = ((f64::from(x) - 39.5) / 60.0, (f64::from(y) - 29.5) / 60.0);
            let (mut a, mut b) = (u, v);
            for _ in 0..50 {
                let (da, db) = distortion.distort(a, b);
                a += u - da;
                b += v - db;
            }
            image::Luma([(2.0 * (a * 60.0 + 39.5)).round().clamp(0.0, 255.0) as u8])
        });
        let table = Undistortion::new(&camera(), &distortion);
        let Pixels::Gray(straight) = table.pixels(&Pixels::Gray(raw)) else { panic!("stays grey") };
        for y in 5..55 {
            for x in 5..75 {
                let value = f64::from(straight.get_pixel(x, y).0[0]);
                assert!((value - 2.0 * f64::from(x)).abs() <= 1.5, "({x}, {y}): {value}");
            }
        }
    }

    #[test]
    fn pixels_from_outside_are_ignored() {
        let pincushion = Distortion { k1: 0.4, ..Distortion::default() };
        let mask = Undistortion::new(&camera(), &pincushion).mask(None).unwrap();
        assert_eq!(mask.get_pixel(0, 0).0[0], 255);
        assert_eq!(mask.get_pixel(40, 30).0[0], 0);
        assert!(Undistortion::new(&camera(), &Distortion::default()).mask(None).is_none());
    }
}
