//! Images to network inputs.

use image::RgbImage;
use rten_tensor::NdTensor;

use crate::manifest::{ColourOrder, InputSpec, Resize};

/// From input pixels back to image pixels: `image = input · factor` a direction, about pixel edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub x: f64,
    pub y: f64,
}

/// Scale of an image of (width, height) in an input of (height, width).
pub(super) fn scale(spec: &InputSpec, image: (u32, u32), input: (usize, usize)) -> Scale {
    let x = f64::from(image.0) / input.1 as f64;
    let y = f64::from(image.1) / input.0 as f64;
    match spec.resize {
        Resize::Stretch => Scale { x, y },
        Resize::Letterbox => {
            // An image that fits within 5 % is not resampled: that would only blur it.
            let both = x.max(y);
            let both = if (0.95..=1.0).contains(&both) { 1.0 } else { both };
            Scale { x: both, y: both }
        }
    }
}

/// Scales, pads, orders and normalises: `[1, 3, H, W]`.
pub(super) fn input(spec: &InputSpec, image: &RgbImage, size: (usize, usize)) -> NdTensor<f32, 4> {
    let (height, width) = size;
    let scale = scale(spec, image.dimensions(), size);
    let channel = |c: usize| if spec.colour == ColourOrder::Bgr { 2 - c } else { c };
    let normal: [[f32; 2]; 3] =
        std::array::from_fn(|c| [spec.scale / spec.std[c], -spec.mean[c] / spec.std[c]]);
    let mut data: Vec<f32> = Vec::with_capacity(3 * height * width);
    for [factor, offset] in normal {
        data.resize(data.len() + height * width, spec.pad * factor + offset);
    }
    let columns = Taps::new(image.width(), width, scale.x);
    let rows = Taps::new(image.height(), height, scale.y);
    let (stride, pixels) = (3 * image.width() as usize, image.as_raw());
    for (y, row) in rows.taps.iter().enumerate() {
        let (top, bottom) = (&pixels[row.first * stride..], &pixels[row.second * stride..]);
        for (x, column) in columns.taps.iter().enumerate() {
            for c in 0..3 {
                let (a, b) = (3 * column.first + channel(c), 3 * column.second + channel(c));
                let mix = |line: &[u8]| {
                    let (left, right) = (f32::from(line[a]), f32::from(line[b]));
                    left + (right - left) * column.weight
                };
                let (above, below) = (mix(top), mix(bottom));
                let value = above + (below - above) * row.weight;
                data[(c * height + y) * width + x] = value * normal[c][0] + normal[c][1];
            }
        }
    }
    NdTensor::from_data([1, 3, height, width], data)
}

/// The two source pixels of a target pixel.
struct Tap {
    first: usize,
    second: usize,
    /// Of the second one.
    weight: f32,
}

struct Taps {
    taps: Vec<Tap>,
}

impl Taps {
    /// Bilinear about pixel edges, as OpenCV's `INTER_LINEAR`. Target pixels beyond the image get no tap.
    fn new(source: u32, target: usize, factor: f64) -> Self {
        let covered = ((f64::from(source) / factor).round() as usize).min(target);
        let last = source as usize - 1;
        let tap = |i: usize| {
            let position = ((i as f64 + 0.5) * factor - 0.5).clamp(0.0, last as f64);
            let first = position as usize;
            Tap { first, second: (first + 1).min(last), weight: (position - first as f64) as f32 }
        };
        Self { taps: (0..covered).map(tap).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use rten_tensor::prelude::*;

    fn spec(resize: Resize) -> InputSpec {
        InputSpec {
            colour: ColourOrder::Bgr,
            resize,
            scale: 0.5,
            mean: [1.0, 2.0, 3.0],
            std: [1.0, 2.0, 4.0],
            pad: 114.0,
            size: None,
        }
    }

    #[test]
    fn letterbox_orders_normalises_and_pads() {
        let image = RgbImage::from_pixel(20, 10, Rgb([40, 80, 120]));
        let tensor = input(&spec(Resize::Letterbox), &image, (10, 10));
        assert_eq!(tensor.shape(), [1, 3, 10, 10]);
        // Blue 120 first: (60 - 1) / 1, green (40 - 2) / 2, red (20 - 3) / 4.
        assert_eq!([tensor[[0, 0, 0, 0]], tensor[[0, 1, 4, 9]], tensor[[0, 2, 2, 3]]], [59.0, 19.0, 4.25]);
        assert_eq!(tensor[[0, 0, 5, 0]], 56.0, "half height, then padding");
        assert_eq!(scale(&spec(Resize::Letterbox), (1242, 375), (384, 1248)), Scale { x: 1.0, y: 1.0 });
    }

    #[test]
    fn stretch_averages_neighbours() {
        let image = RgbImage::from_fn(4, 2, |x, _| Rgb([(x * 20) as u8; 3]));
        let tensor = input(&spec(Resize::Stretch), &image, (2, 2));
        // Columns 0, 1 and 2, 3 meet half way: 10 and 50.
        assert_eq!([tensor[[0, 0, 1, 0]], tensor[[0, 0, 1, 1]]], [4.0, 24.0]);
    }
}
