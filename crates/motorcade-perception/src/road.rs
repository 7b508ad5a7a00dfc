//! The road in a frame.

use image::GrayImage;

/// Probability of road a pixel, at the resolution of the network or file that made it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadMask {
    /// 0 = certainly not, 255 = certainly road.
    probability: GrayImage,
    image_width: u32,
    image_height: u32,
}

impl RoadMask {
    /// A mask, of any resolution, for an image of the given size \[px\].
    pub fn new(probability: GrayImage, image_width: u32, image_height: u32) -> Self {
        Self { probability, image_width, image_height }
    }
    /// Size of the image it speaks of \[px\].
    pub fn image_size(&self) -> (u32, u32) {
        (self.image_width, self.image_height)
    }
    /// The mask at its own resolution.
    pub fn probability_image(&self) -> &GrayImage {
        &self.probability
    }
    /// Probability of road at an image pixel, 0 to 1; 0 outside the image.
    pub fn probability(&self, x: f64, y: f64) -> f64 {
        let (width, height) = self.probability.dimensions();
        // Pixel centres lie at integers: the left edge of the image is at -0.5.
        let u = (x + 0.5) * f64::from(width) / f64::from(self.image_width);
        let v = (y + 0.5) * f64::from(height) / f64::from(self.image_height);
        if !(u >= 0.0 && v >= 0.0 && u < f64::from(width) && v < f64::from(height)) {
            return 0.0;
        }
        f64::from(self.probability.get_pixel(u as u32, v as u32).0[0]) / 255.0
    }
    /// True when the image pixel is more probably road than not.
    pub fn is_road(&self, x: f64, y: f64) -> bool {
        self.probability(x, y) > 0.5
    }
    /// Part of the image that is road, 0 to 1.
    pub fn road_fraction(&self) -> f64 {
        let road = self.probability.pixels().filter(|p| p.0[0] > 127).count();
        road as f64 / self.probability.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn image_pixels_map_to_mask_cells() {
        // 4x2 mask of an 8x8 image: the right half of the lower row is road.
        let mask = GrayImage::from_fn(4, 2, |x, y| image::Luma([if x >= 2 && y == 1 { 255 } else { 0 }]));
        let road = RoadMask::new(mask, 8, 8);
        assert!(road.is_road(4.0, 4.0) && road.is_road(7.0, 7.0));
        assert!(
            !road.is_road(3.0, 4.0)
                && !road.is_road(4.0, 3.0)
                && !road.is_road(8.0, 7.0)
                && !road.is_road(f64::NAN, 7.0)
        );
        assert_eq!(road.road_fraction(), 0.25);
    }
}
