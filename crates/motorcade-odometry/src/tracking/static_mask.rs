//! Pixels that may not be used for the camera's own motion.

use image::GrayImage;
use motorcade_geometry::BoundingBox;
use nalgebra::Point2;

/// What need not be static scene: boxes around vehicles and a mask of pixels to ignore.
#[derive(Clone, Copy, Debug, Default)]
pub struct StaticMask<'a> {
    /// Boxes of things that may move.
    pub boxes: &'a [BoundingBox],
    /// True lets corners on vehicles show that they stand ([`crate::Odometry::classify_static_vehicles`]); false never uses them.
    pub boxes_may_stand: bool,
    /// Non-zero pixels are ignored (a bonnet, burnt-in text).
    pub ignore: Option<&'a GrayImage>,
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// Static, as far as anybody knows.
    Scene,
    /// A vehicle that may stand.
    Vehicle,
    /// The edge of such a vehicle's box, scene or vehicle.
    Rim,
    /// Not to be used.
    Forbidden,
}

/// Corners at the rim of a box already mix background and vehicle.
const BOX_MARGIN_PX: f64 = 4.0;

impl StaticMask<'_> {
    /// True when the pixel may be used without further proof.
    pub fn allows(&self, p: &Point2<f64>) -> bool {
        self.place(p) == Place::Scene
    }

    pub(crate) fn place(&self, p: &Point2<f64>) -> Place {
        if self.ignores(p) {
            return Place::Forbidden;
        }
        match self.boxes.iter().any(|b| b.grown(BOX_MARGIN_PX).contains(p.x, p.y)) {
            false => Place::Scene,
            true if !self.boxes_may_stand => Place::Forbidden,
            true if self.boxes.iter().any(|b| b.contains(p.x, p.y)) => Place::Vehicle,
            true => Place::Rim,
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
