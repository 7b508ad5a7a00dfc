//! Regions of the picture that are fixed to the camera: their search during the drive, and their mask.

use std::borrow::Cow;

use image::GrayImage;
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{FixedRegions, LEAST_FRAMES, MOST_FRAMES};

/// Time between two frames that are used \[ns\].
const INTERVAL_NS: i64 = 100_000_000;
/// Search for what is fixed to the camera, and its result so far.
#[derive(Debug, Default)]
pub(crate) struct FixedParts {
    regions: FixedRegions,
    last_ns: Option<i64>,
    mask: Option<GrayImage>,
    /// True once the mask is not searched for any more.
    settled: bool,
}

impl FixedParts {
    /// A search, or none at all.
    pub(crate) fn new(wanted: bool) -> Self {
        Self { settled: !wanted, ..Self::default() }
    }

    /// True while frames still help.
    pub(crate) fn searching(&self) -> bool {
        !self.settled
    }

    /// Takes a frame of the drive; the mask is renewed every [`LEAST_FRAMES`] frames used.
    pub(crate) fn observe(&mut self, image: &GrayImage, timestamp_ns: i64, camera: &PinholeCamera) {
        let early = self.last_ns.is_some_and(|last| timestamp_ns - last < INTERVAL_NS);
        if self.settled || early || !self.regions.observe(image) {
            return;
        }
        self.last_ns = Some(timestamp_ns);
        if self.regions.frames().is_multiple_of(LEAST_FRAMES) {
            self.mask = self.regions.mask(camera);
            self.settled = self.regions.frames() >= MOST_FRAMES;
        }
    }

    /// Takes the result of a search over frames of the drive.
    pub(crate) fn settle(&mut self, mask: Option<GrayImage>) {
        (self.mask, self.settled) = (mask, true);
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

    /// The result in words; `None` where nothing was found.
    pub(crate) fn describe(&self) -> Option<String> {
        let mask = self.mask.as_ref()?;
        let rows = mask.enumerate_pixels().filter(|(.., p)| p.0[0] != 0).map(|(_, y, _)| y);
        let first = rows.clone().min()?;
        let share = 100.0 * rows.count() as f64 / mask.len().max(1) as f64;
        Some(format!(
            "{share:.1} % of the picture, from row {first} down, is fixed to the camera (bonnet, reflections) and left out; \
             --set run.fixed_regions=false takes it for the scene"
        ))
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    fn bonnet() -> FixedParts {
        let mask = GrayImage::from_fn(100, 60, |_, y| if y >= 40 { Luma([255]) } else { Luma([0]) });
        let mut parts = FixedParts::new(true);
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
        assert!(FixedParts::new(false).with(None).is_none());
    }

    #[test]
    fn what_was_found_is_said() {
        let said = bonnet().describe().unwrap();
        assert!(said.contains("33.3 %") && said.contains("row 40"), "{said}");
        assert!(FixedParts::new(true).describe().is_none());
    }
}
