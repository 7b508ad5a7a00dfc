//! Pixels that are excluded from the camera's own motion.

use image::GrayImage;
use motorcade_geometry::BoundingBox;
use nalgebra::Point2;

use super::options::AdvancedKltOptions;

/// Regions that need not be static: vehicle boxes and a mask of pixels to ignore.
#[derive(Clone, Copy, Debug)]
pub struct StaticMask<'a> {
    /// Boxes of objects that may move.
    pub boxes: &'a [BoundingBox],
    /// True lets corners on vehicles be used once their vehicle is classified as static
    /// ([`crate::Odometry::classify_static_vehicles`]); false never uses them.
    pub boxes_may_stand: bool,
    /// Non-zero pixels are ignored (a bonnet, burnt-in text).
    pub ignore: Option<&'a GrayImage>,
    /// Width of the border around a box in which a corner mixes background and vehicle \[px\], [`AdvancedKltOptions::box_rim_px`].
    pub rim_px: f64,
}

impl Default for StaticMask<'_> {
    fn default() -> Self {
        let rim_px = AdvancedKltOptions::default().box_rim_px;
        Self { boxes: &[], boxes_may_stand: false, ignore: None, rim_px }
    }
}

/// Class of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PixelClass {
    /// Static scene.
    Scene,
    /// A vehicle that may be static.
    Vehicle,
    /// The border of such a vehicle's box: scene or vehicle.
    BoxRim,
    /// Not to be used.
    Excluded,
}

impl StaticMask<'_> {
    /// True when the pixel is scene and may be used.
    pub fn allows(&self, p: &Point2<f64>) -> bool {
        self.class(p) == PixelClass::Scene
    }

    pub(crate) fn class(&self, p: &Point2<f64>) -> PixelClass {
        if self.ignores(p) {
            return PixelClass::Excluded;
        }
        match self.boxes.iter().any(|b| b.grown(self.rim_px).contains(p.x, p.y)) {
            false => PixelClass::Scene,
            true if !self.boxes_may_stand => PixelClass::Excluded,
            true if self.boxes.iter().any(|b| b.contains(p.x, p.y)) => PixelClass::Vehicle,
            true => PixelClass::BoxRim,
        }
    }

    fn ignores(&self, p: &Point2<f64>) -> bool {
        self.ignore.is_some_and(|image| {
            let (x, y) = (p.x.round(), p.y.round());
            let inside =
                x >= 0.0 && y >= 0.0 && x < f64::from(image.width()) && y < f64::from(image.height());
            inside && image.get_pixel(x as u32, y as u32).0[0] != 0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_divide_the_image_into_scene_rim_and_vehicle() {
        let boxes = [BoundingBox { x1: 10.0, y1: 10.0, x2: 30.0, y2: 20.0 }];
        let mut ignore = GrayImage::new(60, 40);
        ignore.put_pixel(50, 5, image::Luma([1]));
        let mask = StaticMask {
            boxes: &boxes,
            boxes_may_stand: true,
            ignore: Some(&ignore),
            ..StaticMask::default()
        };
        let class = |mask: &StaticMask<'_>, x: f64, y: f64| mask.class(&Point2::new(x, y));
        assert_eq!(class(&mask, 20.0, 15.0), PixelClass::Vehicle);
        assert_eq!(class(&mask, 32.0, 15.0), PixelClass::BoxRim);
        assert_eq!(class(&mask, 35.0, 15.0), PixelClass::Scene);
        assert_eq!(class(&mask, 50.2, 5.4), PixelClass::Excluded);
        let excluding = StaticMask { boxes_may_stand: false, ..mask };
        assert_eq!(class(&excluding, 32.0, 15.0), PixelClass::Excluded);
        assert!(!excluding.allows(&Point2::new(20.0, 15.0)) && excluding.allows(&Point2::new(35.0, 15.0)));
    }
}
