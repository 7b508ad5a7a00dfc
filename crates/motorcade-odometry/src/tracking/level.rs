//! One grey image in `f32`, with interpolation.

use image::GrayImage;

/// One grey level image, row-major, intensities 0–255.
#[derive(Clone, Debug, Default)]
pub struct PyramidLevel {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) data: Vec<f32>,
}

impl PyramidLevel {
    /// From 8-bit grey.
    pub fn from_gray(image: &GrayImage) -> Self {
        let mut out = Self::default();
        out.refill(image);
        out
    }
    pub(super) fn refill(&mut self, image: &GrayImage) {
        (self.width, self.height) = (image.width() as usize, image.height() as usize);
        self.data.clear();
        self.data.extend(image.as_raw().iter().map(|v| f32::from(*v)));
    }
    /// Standard deviation of the values.
    pub(super) fn contrast(&self) -> f32 {
        let sum = |f: fn(f64) -> f64| self.data.iter().map(|v| f(f64::from(*v))).sum::<f64>();
        let n = self.data.len().max(1) as f64;
        let mean = sum(|v| v) / n;
        (sum(|v| v * v) / n - mean * mean).max(0.0).sqrt() as f32
    }
    /// Width \[px\].
    pub fn width(&self) -> usize {
        self.width
    }
    /// Height \[px\].
    pub fn height(&self) -> usize {
        self.height
    }
    /// One row.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.width..(y + 1) * self.width]
    }
    /// Bilinear value; `None` outside.
    pub fn sample(&self, x: f32, y: f32) -> Option<f32> {
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (x0, y0) = (x as usize, y as usize);
        if x0 + 1 >= self.width || y0 + 1 >= self.height {
            return None;
        }
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let i = y0 * self.width + x0;
        let d = &self.data;
        let top = d[i] + fx * (d[i + 1] - d[i]);
        let bottom = d[i + self.width] + fx * (d[i + self.width + 1] - d[i + self.width]);
        Some(top + fy * (bottom - top))
    }
    /// Bilinear value and its central-difference gradient per pixel; `None` within two pixels of the border.
    #[inline]
    pub fn sample_with_gradient(&self, x: f32, y: f32) -> Option<[f32; 3]> {
        if !(x >= 1.0 && y >= 1.0) {
            return None;
        }
        let (x0, y0) = (x as usize, y as usize);
        if x0 + 2 >= self.width || y0 + 2 >= self.height {
            return None;
        }
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let w = self.width;
        let i = y0 * w + x0;
        let rows = &self.data[i - w - 1..i + 2 * w + 3];
        let at = |r: usize, c: usize| rows[r * w + c];
        let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
        let line = |r: usize, c: usize| mix(at(r, c), at(r, c + 1), fx);
        let (up, top, bottom, down) = (line(0, 1), line(1, 1), line(2, 1), line(3, 1));
        let column = |c: usize| mix(at(1, c), at(2, c), fy);
        let value = mix(top, bottom, fy);
        let dx = 0.5 * mix(column(2) - column(0), column(3) - column(1), fx);
        let dy = 0.5 * mix(bottom - up, down - top, fy);
        Some([value, dx, dy])
    }
    /// Half-size image of `finer`, smoothed by the binomial kernel 1 4 6 4 1 in both directions. `columns` is scratch.
    pub(super) fn refill_halved(&mut self, finer: &PyramidLevel, columns: &mut Vec<f32>) {
        let (width, height) = (finer.width / 2, finer.height / 2);
        (self.width, self.height) = (width, height);
        self.data.clear();
        self.data.reserve(width * height);
        columns.resize(finer.width, 0.0);
        for y in 0..height {
            let clamp = |dy: isize| (2 * y as isize + dy).clamp(0, finer.height as isize - 1) as usize;
            let rows = [-2, -1, 0, 1, 2].map(|dy| finer.row(clamp(dy)));
            for (x, out) in columns.iter_mut().enumerate() {
                *out = rows[0][x] + rows[4][x] + 4.0 * (rows[1][x] + rows[3][x]) + 6.0 * rows[2][x];
            }
            for x in 0..width {
                let at =
                    |dx: isize| columns[(2 * x as isize + dx).clamp(0, finer.width as isize - 1) as usize];
                self.data.push((at(-2) + at(2) + 4.0 * (at(-1) + at(1)) + 6.0 * at(0)) / 256.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn gradient_of_a_ramp() {
        let image = GrayImage::from_fn(64, 64, |x, y| Luma([(x + 2 * y) as u8]));
        let plane = PyramidLevel::from_gray(&image);
        let [value, dx, dy] = plane.sample_with_gradient(10.25, 20.5).unwrap();
        assert!((value - 51.25).abs() < 1e-4 && (dx - 1.0).abs() < 1e-4 && (dy - 2.0).abs() < 1e-4);
        assert!(plane.sample_with_gradient(0.5, 20.0).is_none());
        assert!(plane.sample_with_gradient(f32::NAN, 20.0).is_none());
    }
}
