//! Grey image pyramids in `f32`.

use image::GrayImage;

/// One grey level image, row-major, intensities 0–255.
#[derive(Clone, Debug, Default)]
pub struct Plane {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

impl Plane {
    /// From 8-bit grey.
    pub fn from_gray(image: &GrayImage) -> Self {
        let mut out = Self::default();
        out.refill(image);
        out
    }
    fn refill(&mut self, image: &GrayImage) {
        (self.width, self.height) = (image.width() as usize, image.height() as usize);
        self.data.clear();
        self.data.extend(image.as_raw().iter().map(|v| f32::from(*v)));
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
    /// Becomes half the size of `finer`, smoothed by the binomial kernel 1 4 6 4 1 in both directions. `columns` is scratch.
    fn refill_halved(&mut self, finer: &Plane, columns: &mut Vec<f32>) {
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

/// An image and its successive halvings, level 0 first.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<Plane>,
    /// One row of sums while a level is halved.
    columns: Vec<f32>,
}

/// No side of a halved level is shorter \[px\].
const LEAST_SIDE_PX: usize = 32;

impl Pyramid {
    /// Builds up to `levels` levels; stops before a side falls under 32 px.
    pub fn new(image: &GrayImage, levels: usize) -> Self {
        let mut out = Self { levels: Vec::new(), columns: Vec::new() };
        out.refill(image, levels);
        out
    }
    /// Becomes what [`Pyramid::new`] makes of another image; one of the same size takes no memory.
    pub fn refill(&mut self, image: &GrayImage, levels: usize) {
        let shorter = image.width().min(image.height()) as usize;
        let fitting = (1..levels).take_while(|k| shorter >> k >= LEAST_SIDE_PX).count();
        self.levels.resize_with(1 + fitting, Plane::default);
        self.levels[0].refill(image);
        for k in 1..=fitting {
            let (finer, coarser) = self.levels.split_at_mut(k);
            coarser[0].refill_halved(&finer[k - 1], &mut self.columns);
        }
    }
    /// Number of levels.
    pub fn len(&self) -> usize {
        self.levels.len()
    }
    /// Never true: level 0 always exists.
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }
    /// A level, 0 the finest.
    pub fn level(&self, level: usize) -> &Plane {
        &self.levels[level]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn halving_keeps_a_ramp() {
        let image = GrayImage::from_fn(128, 96, |x, _| Luma([x as u8]));
        let pyramid = Pyramid::new(&image, 2);
        let half = pyramid.level(1);
        // Pixel centres at integers: level-1 pixel x sits on level-0 pixel 2x.
        assert_eq!(half.sample(20.0, 20.0), Some(40.0));
    }

    #[test]
    fn a_pyramid_filled_again_is_the_new_one() {
        let image = |width: u32, height: u32, grain: u32| {
            GrayImage::from_fn(width, height, |x, y| Luma([((x * x + grain * y * (x + 3)) % 251) as u8]))
        };
        let mut again = Pyramid::new(&image(200, 150, 5), 4);
        // The same size, smaller with fewer levels, larger with more.
        for other in [image(200, 150, 7), image(90, 70, 3), image(300, 280, 11)] {
            again.refill(&other, 4);
            let new = Pyramid::new(&other, 4);
            assert_eq!(again.len(), new.len());
            for level in 0..new.len() {
                let (a, b) = (again.level(level), new.level(level));
                assert_eq!((a.width, a.height), (b.width, b.height));
                assert!(a.data.iter().zip(&b.data).all(|(a, b)| a.to_bits() == b.to_bits()));
                assert_eq!(a.data.len(), b.data.len());
            }
        }
    }

    #[test]
    fn gradient_of_a_ramp() {
        let image = GrayImage::from_fn(64, 64, |x, y| Luma([(x + 2 * y) as u8]));
        let plane = Plane::from_gray(&image);
        let [value, dx, dy] = plane.sample_with_gradient(10.25, 20.5).unwrap();
        assert!((value - 51.25).abs() < 1e-4 && (dx - 1.0).abs() < 1e-4 && (dy - 2.0).abs() < 1e-4);
        assert!(plane.sample_with_gradient(0.5, 20.0).is_none());
        assert!(plane.sample_with_gradient(f32::NAN, 20.0).is_none());
    }
}
