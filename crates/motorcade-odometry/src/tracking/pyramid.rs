//! Image pyramids.

use image::GrayImage;

use super::level::PyramidLevel;

/// An image and its successive halvings, level 0 first.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<PyramidLevel>,
    /// Standard deviation of the grey values of the coarsest level.
    contrast: f32,
    /// One row of sums while a level is halved.
    columns: Vec<f32>,
}

/// Least side of a halved level \[px\]: twice the patch of the tracker.
const LEAST_SIDE_PX: usize = 32;

impl Pyramid {
    /// Builds up to `levels` levels; stops before a side falls under 32 px.
    pub fn new(image: &GrayImage, levels: usize) -> Self {
        let mut out = Self { levels: Vec::new(), contrast: 0.0, columns: Vec::new() };
        out.refill(image, levels);
        out
    }
    /// As [`Pyramid::new`], in place; an image of the same size allocates nothing.
    pub fn refill(&mut self, image: &GrayImage, levels: usize) {
        let shorter = image.width().min(image.height()) as usize;
        let fitting = (1..levels).take_while(|k| shorter >> k >= LEAST_SIDE_PX).count();
        self.levels.resize_with(1 + fitting, PyramidLevel::default);
        self.levels[0].refill(image);
        for k in 1..=fitting {
            let (finer, coarser) = self.levels.split_at_mut(k);
            coarser[0].refill_halved(&finer[k - 1], &mut self.columns);
        }
        self.contrast = self.levels[fitting].contrast();
    }
    /// Standard deviation of the grey values, on the coarsest level.
    pub fn contrast(&self) -> f32 {
        self.contrast
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
    pub fn level(&self, level: usize) -> &PyramidLevel {
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
    fn a_refilled_pyramid_equals_a_new_one() {
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
}
