//! Crops of a frame around boxes, as inputs of keypoint networks.
//!
//! The crop is the box enlarged about its middle, stretched to a square input. Along each axis the image is averaged over the
//! extent of an input pixel where that is wider than an image pixel, and interpolated linearly otherwise. Input pixels whose
//! centre lies outside the image are 0 after normalisation.

use image::RgbImage;

use crate::detection::BoundingBox;

/// Input width and height \[px\].
pub(super) const INPUT_PX: usize = 64;
/// Crop over box.
const MARGIN: f64 = 1.24;
/// Normalisation: `(pixel / 255 − MEAN) / DEVIATION`.
const MEAN: f32 = 0.5;
const DEVIATION: f32 = 0.25;

/// Place of a crop in the image \[px\], pixel centres at integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CropFrame {
    x1: f64,
    y1: f64,
    width: f64,
    height: f64,
}

impl CropFrame {
    pub(super) fn of_box(bbox: &BoundingBox) -> Self {
        let ((x, y), width, height) = (bbox.centre(), MARGIN * bbox.width(), MARGIN * bbox.height());
        Self { x1: x - 0.5 * width, y1: y - 0.5 * height, width, height }
    }

    /// From 0..1 in the crop, edge to edge, to pixels of the image.
    pub(super) fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        [self.x1 + x * self.width, self.y1 + y * self.height]
    }

    /// From shares of the crop's width and height to pixels of the image.
    pub(super) fn extent(&self, x: f64, y: f64) -> [f64; 2] {
        [x * self.width, y * self.height]
    }

    /// Appends the four channels R, G, B and log aspect, `INPUT_PX`² each.
    pub(super) fn append(&self, image: &RgbImage, out: &mut Vec<f32>) {
        let columns = Axis::new(self.x1, self.width, image.width() as usize);
        let rows = Axis::new(self.y1, self.height, image.height() as usize);
        let (stride, pixels) = (3 * image.width() as usize, image.as_raw());
        for channel in 0..3 {
            for row in &rows.taps {
                for column in &columns.taps {
                    let mut sum = 0.0;
                    for (y, wy) in row.iter() {
                        let line = &pixels[y * stride..][..stride];
                        sum += wy
                            * column.iter().map(|(x, wx)| wx * f32::from(line[3 * x + channel])).sum::<f32>();
                    }
                    let inside = row.inside && column.inside;
                    out.push(if inside { (sum / 255.0 - MEAN) / DEVIATION } else { 0.0 });
                }
            }
        }
        let aspect = (self.width / self.height).ln() as f32;
        out.resize(out.len() + INPUT_PX * INPUT_PX, aspect);
    }
}

/// Image pixels that make one input pixel along an axis.
struct Tap {
    first: usize,
    weights: Vec<f32>,
    inside: bool,
}

impl Tap {
    fn iter(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        self.weights.iter().enumerate().map(|(k, w)| (self.first + k, *w))
    }
}

struct Axis {
    taps: Vec<Tap>,
}

impl Axis {
    fn new(start: f64, extent: f64, size: usize) -> Self {
        let step = extent / INPUT_PX as f64;
        let last = size.saturating_sub(1);
        let tap = |i: usize| {
            let centre = start + (i as f64 + 0.5) * step;
            let inside = centre >= -0.5 && centre <= size as f64 - 0.5;
            if !inside {
                return Tap { first: 0, weights: Vec::new(), inside };
            }
            let (low, high) = if step > 1.0 {
                (centre - 0.5 * step, centre + 0.5 * step)
            } else {
                let held = centre.clamp(0.0, last as f64);
                (held.floor(), held.floor() + 1.0)
            };
            let first = if step > 1.0 { (low + 0.5).floor().max(0.0) } else { low } as usize;
            let end = (if step > 1.0 { (high + 0.5).ceil() } else { high + 1.0 } as usize)
                .clamp(first + 1, last + 1);
            let weight = |pixel: usize| {
                let pixel = pixel as f64;
                if step > 1.0 {
                    (high.min(pixel + 0.5) - low.max(pixel - 0.5)).max(0.0)
                } else {
                    (1.0 - (centre.clamp(0.0, last as f64) - pixel).abs()).max(0.0)
                }
            };
            let weights: Vec<f64> = (first..end.max(first + 1)).map(weight).collect();
            let total: f64 = weights.iter().sum::<f64>().max(1e-9);
            Tap { first, weights: weights.iter().map(|w| (w / total) as f32).collect(), inside }
        };
        Self { taps: (0..INPUT_PX).map(tap).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn a_large_box_is_averaged_and_the_outside_is_zero() {
        let image = RgbImage::from_fn(400, 300, |x, _| Rgb([if x % 2 == 0 { 100 } else { 200 }, 0, 255]));
        // 200 px of box, 248 px of crop: from -24 to 224, so that the first 6 columns lie outside.
        let crop = CropFrame::of_box(&BoundingBox::new([0.0, 50.0, 200.0, 250.0]));
        let mut out = Vec::new();
        crop.append(&image, &mut out);
        assert_eq!(out.len(), 4 * INPUT_PX * INPUT_PX);
        let middle = out[32 * INPUT_PX + 32];
        assert!((middle - (150.0 / 255.0 - 0.5) / 0.25).abs() < 0.1, "{middle}");
        assert_eq!(out[32 * INPUT_PX], 0.0);
        assert!(out[3 * INPUT_PX * INPUT_PX..].iter().all(|v| *v == 0.0), "a square box");
        assert_eq!(crop.pixel(0.5, 0.5), [100.0, 150.0]);
    }

    #[test]
    fn a_small_box_is_interpolated() {
        let image = RgbImage::from_fn(40, 30, |x, _| Rgb([5 * x as u8; 3]));
        let crop = CropFrame::of_box(&BoundingBox::new([10.0, 10.0, 20.0, 20.0]));
        let mut out = Vec::new();
        crop.append(&image, &mut out);
        let pixel = |x: f64| (5.0 * x / 255.0 - 0.5) / 0.25;
        for i in [0, 31, 63] {
            let x = 8.8 + (i as f64 + 0.5) * 12.4 / 64.0;
            assert!((f64::from(out[20 * INPUT_PX + i]) - pixel(x)).abs() < 1e-4, "{i}");
        }
    }
}
