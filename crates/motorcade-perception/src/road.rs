//! The road in a frame.

use image::GrayImage;
use motorcade_geometry::BoundingBox;
use nalgebra::Point2;

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
    /// Mean probability of road in the strip below a box: what a vehicle stands on. Points for which `shows` is false are left out, as those on other
    /// vehicles are. `None` where too little of the strip shows.
    pub fn share_below(
        &self,
        bbox: &BoundingBox,
        options: &RoadBelowOptions,
        shows: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<f64> {
        const COLUMNS: u32 = 16;
        const ROWS: u32 = 6;
        let cell_px = f64::from(self.image_height) / f64::from(self.probability.height().max(1));
        let depth_px = (options.height_share * bbox.height()).max(options.least_cells * cell_px);
        let share = |k: u32, count: u32| (f64::from(k) + 0.5) / f64::from(count);
        let (right, bottom) = (f64::from(self.image_width) - 0.5, f64::from(self.image_height) - 0.5);
        let inside = |p: &Point2<f64>| p.x > -0.5 && p.x < right && p.y > -0.5 && p.y < bottom;
        let row = |r: u32| {
            let y = bbox.y2 + share(r, ROWS) * depth_px;
            (0..COLUMNS).map(move |c| Point2::new(bbox.x1 + share(c, COLUMNS) * bbox.width(), y))
        };
        let shown = (0..ROWS).flat_map(row).filter(|p| inside(p) && shows(p));
        let (sum, count) = shown.fold((0.0, 0_u32), |(sum, n), p| (sum + self.probability(p.x, p.y), n + 1));
        (f64::from(count) >= options.least_shown * f64::from(ROWS * COLUMNS)).then(|| sum / f64::from(count))
    }
    /// Part of the image that is road, 0 to 1.
    pub fn road_fraction(&self) -> f64 {
        let road = self.probability.pixels().filter(|p| p.0[0] > 127).count();
        road as f64 / self.probability.len().max(1) as f64
    }
}

/// Strip below a box whose road tells what a vehicle stands on. None of these numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RoadBelowOptions {
    /// Height of the strip \[heights of the box\]. A larger one sees past what the vehicle stands on.
    pub height_share: f64,
    /// Least height of the strip \[cells of the mask\]: thinner ones are the edge of the vehicle.
    pub least_cells: f64,
    /// Share of the strip that must show. A larger one leaves more vehicles without an answer.
    pub least_shown: f64,
}

impl Default for RoadBelowOptions {
    fn default() -> Self {
        Self { height_share: 0.25, least_cells: 3.0, least_shown: 0.4 }
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

    #[test]
    fn road_below_a_box_is_known_where_it_shows() {
        // The lower half is road on the right, verge on the left.
        let mask =
            GrayImage::from_fn(100, 100, |x, y| image::Luma([if x >= 50 && y >= 50 { 255 } else { 0 }]));
        let road = RoadMask::new(mask, 200, 200);
        let at = |x1: f64, y2: f64| BoundingBox { x1, y1: y2 - 40.0, x2: x1 + 40.0, y2 };
        let everywhere = |_: &Point2<f64>| true;
        let options = &RoadBelowOptions::default();
        assert_eq!(road.share_below(&at(120.0, 130.0), options, everywhere), Some(1.0));
        assert_eq!(road.share_below(&at(20.0, 130.0), options, everywhere), Some(0.0));
        assert_eq!(road.share_below(&at(80.0, 130.0), options, everywhere), Some(0.5));
        // Below the picture, or hidden by another vehicle: not known.
        assert_eq!(road.share_below(&at(120.0, 198.0), options, everywhere), None);
        assert_eq!(road.share_below(&at(120.0, 130.0), options, |p| p.x > 150.0), None);
    }
}
