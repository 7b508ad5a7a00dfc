//! Regions of the picture that are fixed to the camera: their search during the drive, and their mask.

use std::borrow::Cow;

use image::GrayImage;
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, FixedRegionOptions, FixedRegions, connected_regions};

/// Search for what is fixed to the camera, and its result so far.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct FixedParts {
    regions: FixedRegions,
    last_ns: Option<i64>,
    found: Vec<FoundRegion>,
    /// All that was found but what belongs to a vehicle that is followed.
    #[serde(with = "crate::state::grey_image")]
    mask: Option<GrayImage>,
    /// True once the mask is not searched for any more.
    settled: bool,
}

impl FixedParts {
    /// A search, or none at all.
    pub(crate) fn new(wanted: bool, options: FixedRegionOptions) -> Self {
        Self { settled: !wanted, regions: FixedRegions::new(options), ..Self::default() }
    }

    /// As after the frame of a state, with the options of this one.
    pub(crate) fn resumed(&self, state: Self) -> Self {
        let options = *self.regions.options();
        let Self { regions, last_ns, found, mask, settled } = state;
        Self { regions: regions.with_options(options), last_ns, found, mask, settled }
    }

    /// True while frames still help.
    pub(crate) fn searching(&self) -> bool {
        !self.settled
    }

    /// Takes a frame of the drive; the mask is renewed every `least_frames` frames used.
    pub(crate) fn observe(&mut self, image: &GrayImage, timestamp_ns: i64, camera: &PinholeCamera) {
        let interval_ns = (self.regions.options().interval_s * 1e9).round() as i64;
        let early = self.last_ns.is_some_and(|last| timestamp_ns - last < interval_ns);
        if self.settled || early || !self.regions.observe(image) {
            return;
        }
        self.last_ns = Some(timestamp_ns);
        let (frames, options) = (self.regions.frames(), *self.regions.options());
        if frames.is_multiple_of(options.least_frames) {
            self.set_mask(self.regions.mask(camera));
            self.settled = frames >= options.most_frames;
        }
    }

    /// Takes the result of a search over frames of the drive.
    pub(crate) fn settle(&mut self, mask: Option<GrayImage>) {
        self.set_mask(mask);
        self.settled = true;
    }

    fn set_mask(&mut self, mask: Option<GrayImage>) {
        self.found = mask
            .iter()
            .flat_map(|mask| connected_regions(mask, self.regions.options()))
            .map(FoundRegion::new)
            .collect();
        self.mask = mask;
    }

    /// Takes the boxes of a frame's vehicles. A vehicle that is followed at a constant distance stays where it is in the picture, too: what is on
    /// one in most frames is not fixed to the camera.
    pub(crate) fn observe_vehicles(&mut self, vehicles: &[BoundingBox]) {
        let Self { mask: Some(mask), found, regions, .. } = self else { return };
        for region in found {
            let before = region.is_vehicle();
            region.observe(vehicles, regions.options());
            if region.is_vehicle() != before {
                let value = if before { 255 } else { 0 };
                region.pixels.iter().for_each(|(x, y)| mask.put_pixel(*x, *y, image::Luma([value])));
            }
        }
    }

    /// Pixels to ignore: those given and those found.
    pub(crate) fn with<'a>(&'a self, given: Option<&'a GrayImage>) -> Option<Cow<'a, GrayImage>> {
        match (given, &self.mask) {
            (None, None) => None,
            (Some(one), None) | (None, Some(one)) => Some(Cow::Borrowed(one)),
            (Some(given), Some(found)) => {
                let mut both = given.clone();
                both.iter_mut().zip(found.iter()).for_each(|(a, b)| *a |= *b);
                Some(Cow::Owned(both))
            }
        }
    }

    /// Rectangles around what is fixed to the camera \[px\].
    pub(crate) fn regions(&self) -> Vec<BoundingBox> {
        self.found.iter().filter(|region| !region.is_vehicle()).map(|region| region.bbox).collect()
    }

    /// The result in words; `None` where nothing was found.
    pub(crate) fn describe(&self) -> Option<String> {
        let mask = self.mask.as_ref()?;
        let rows = mask.enumerate_pixels().filter(|(.., p)| p.0[0] != 0).map(|(_, y, _)| y);
        // None where all that stayed was on vehicles.
        let first = rows.clone().min()?;
        let share = 100.0 * rows.count() as f64 / mask.len().max(1) as f64;
        Some(format!(
            "{share:.1} % of the picture, from row {first} down, is fixed to the camera (bonnet, reflections) and left out; \
             --set run.fixed_regions=false takes it for the scene"
        ))
    }
}

/// A connected region of the mask.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct FoundRegion {
    pixels: Vec<(u32, u32)>,
    bbox: BoundingBox,
    /// Frames since it was found, and those in which it was on a vehicle.
    frames: u32,
    on_vehicle: u32,
}

impl FoundRegion {
    fn new(pixels: Vec<(u32, u32)>) -> Self {
        let empty = BoundingBox::new([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY]);
        let bbox = pixels.iter().map(|(x, y)| (f64::from(*x), f64::from(*y))).fold(empty, |b, (x, y)| {
            BoundingBox::new([b.x1.min(x), b.y1.min(y), b.x2.max(x + 1.0), b.y2.max(y + 1.0)])
        });
        Self { pixels, bbox, frames: 0, on_vehicle: 0 }
    }

    fn observe(&mut self, vehicles: &[BoundingBox], options: &FixedRegionOptions) {
        let within = |vehicle: &BoundingBox| {
            let shadow = vehicle.y2 + options.shadow_height * vehicle.height();
            let around = BoundingBox::new([vehicle.x1, vehicle.y1, vehicle.x2, shadow]);
            self.bbox.intersection(&around) >= options.within_vehicle * self.bbox.area()
        };
        self.on_vehicle += u32::from(vehicles.iter().any(within));
        self.frames += 1;
    }

    /// True when it was on a vehicle in most frames.
    fn is_vehicle(&self) -> bool {
        2 * self.on_vehicle > self.frames
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    fn bonnet() -> FixedParts {
        let mask = GrayImage::from_fn(100, 60, |_, y| if y >= 40 { Luma([255]) } else { Luma([0]) });
        let mut parts = FixedParts::new(true, FixedRegionOptions::default());
        parts.settle(Some(mask));
        parts
    }

    #[test]
    fn given_and_found_pixels_are_ignored() {
        let mut given = GrayImage::new(100, 60);
        given.put_pixel(5, 5, Luma([255]));
        let parts = bonnet();
        let both = parts.with(Some(&given)).unwrap();
        assert!(both.get_pixel(5, 5).0[0] != 0 && both.get_pixel(5, 45).0[0] != 0);
        assert_eq!(both.get_pixel(50, 20).0[0], 0);
        assert!(FixedParts::new(false, FixedRegionOptions::default()).with(None).is_none());
    }

    #[test]
    fn what_stays_on_a_vehicle_is_none() {
        let mask = GrayImage::from_fn(100, 60, |x, y| {
            let bonnet = y >= 50;
            let shadow = (40..60).contains(&x) && (30..36).contains(&y);
            Luma([if bonnet || shadow { 255 } else { 0 }])
        });
        let mut parts = FixedParts::new(true, FixedRegionOptions::default());
        parts.settle(Some(mask));
        let car = BoundingBox::new([35.0, 5.0, 65.0, 32.0]);
        let set = |parts: &FixedParts, x, y| parts.with(None).unwrap().get_pixel(x, y).0[0] != 0;
        for (boxes, shadow) in [(&[car][..], false), (&[], true), (&[car], false)] {
            parts.observe_vehicles(boxes);
            assert_eq!((set(&parts, 50, 33), set(&parts, 50, 55)), (shadow, true));
        }
    }

    #[test]
    fn what_was_found_is_said() {
        let said = bonnet().describe().unwrap();
        assert!(said.contains("33.3 %") && said.contains("row 40"), "{said}");
        assert!(FixedParts::new(true, FixedRegionOptions::default()).describe().is_none());
    }
}
