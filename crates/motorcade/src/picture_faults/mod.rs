//! Faults of pictures that the odometry survives, reported with their frames: jumps of exposure, parts without texture, parts that blur.

mod blank;
mod blur;
mod cells;
mod exposure;
mod options;

use image::GrayImage;

pub use options::PictureFaultOptions;

use blank::BlankParts;
use blur::BlurredParts;
use cells::Cells;
use exposure::ExposureJumps;

/// Compares each picture with the one before. The memory it takes does not grow with the drive but for what it found.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct PictureFaults {
    before: Cells,
    now: Cells,
    last_ns: Option<i64>,
    was_blank: bool,
    exposure: ExposureJumps,
    blank: BlankParts,
    blurred: BlurredParts,
}

impl PictureFaults {
    /// Takes the next picture; repeated ones are left out.
    pub fn observe(
        &mut self,
        image: &GrayImage,
        number: u64,
        timestamp_ns: i64,
        options: &PictureFaultOptions,
    ) {
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.measure(image, options.columns, options.least_cell_px);
        let interval_s = self.last_ns.map_or(f64::INFINITY, |last| (timestamp_ns - last) as f64 * 1e-9);
        self.last_ns = Some(timestamp_ns);
        if interval_s > options.blur_longest_s {
            self.blurred.restart();
        }
        if interval_s > options.longest_s {
            self.was_blank = false;
        } else if self.before.len() == self.now.len() {
            let blank = self.blank.observe(number, &self.before, &self.now, options);
            if !blank && !self.was_blank {
                self.exposure.observe(number, &self.before, &self.now, options);
            }
            self.was_blank = blank;
        }
        self.blurred.observe(number, &self.now, options);
    }

    /// The findings in words.
    pub fn describe(&self) -> Vec<String> {
        let (exposure, blank) = (self.exposure.describe(), self.blank.describe());
        exposure.into_iter().chain(blank).chain(self.blurred.describe()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The small pictures of these tests have half as many cells across.
    fn options() -> PictureFaultOptions {
        PictureFaultOptions { columns: 12, ..PictureFaultOptions::default() }
    }

    /// A texture that moves by 3 px a frame.
    fn picture(k: u32) -> GrayImage {
        GrayImage::from_fn(144, 72, |x, y| {
            let hash = ((x + 3 * k).wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503))
                .wrapping_mul(2_246_822_519);
            image::Luma([60 + (hash >> 26) as u8])
        })
    }

    fn said(change: impl Fn(u32, GrayImage) -> GrayImage) -> Vec<String> {
        said_every(100, change)
    }

    fn said_every(interval_ms: i64, change: impl Fn(u32, GrayImage) -> GrayImage) -> Vec<String> {
        let mut faults = PictureFaults::default();
        for k in 0..40 {
            let image = change(k, picture(k));
            faults.observe(&image, u64::from(100 + k), i64::from(k) * interval_ms * 1_000_000, &options());
        }
        faults.describe()
    }

    /// Changes the pixels of a rectangle.
    fn part(
        mut image: GrayImage,
        x: std::ops::Range<u32>,
        y: std::ops::Range<u32>,
        f: impl Fn(u32, u32, u8) -> u8,
    ) -> GrayImage {
        for (px, py) in y.flat_map(|py| x.clone().map(move |px| (px, py))) {
            let pixel = image.get_pixel_mut(px, py);
            pixel.0[0] = f(px, py, pixel.0[0]);
        }
        image
    }

    #[test]
    fn a_clean_drive_gives_no_warning() {
        assert_eq!(said(|_, image| image), Vec::<String>::new());
        // Brighter by 20 % within a frame, as under a bridge, and gradually by half.
        let brighter = |k: u32, image: GrayImage| {
            let gain = if k < 10 { 1.0 } else { 1.2 + 0.01 * f64::from(k) };
            part(image, 0..144, 0..72, |_, _, v| (gain * f64::from(v)) as u8)
        };
        assert_eq!(said(brighter), Vec::<String>::new());
    }

    #[test]
    fn exposure_that_jumps_is_reported_by_its_frames() {
        let halved = |k: u32, image: GrayImage| {
            if (20..23).contains(&k) { part(image, 0..144, 0..72, |_, _, v| v / 2) } else { image }
        };
        let said = said(halved);
        assert!(
            said.len() == 1
                && said[0].starts_with("exposure jumps")
                && said[0].contains("in frames 120, 123;"),
            "{said:?}"
        );
    }

    #[test]
    fn a_grey_half_is_reported_by_its_frames_and_is_no_dirt() {
        let grey = |k: u32, image: GrayImage| {
            if (20..30).contains(&k) { part(image, 0..72, 0..72, |_, _, _| 128) } else { image }
        };
        let said = said(grey);
        assert!(
            said.len() == 1
                && said[0].starts_with("up to 50 % of the picture")
                && said[0].contains("in frames 120 to 129:"),
            "{said:?}"
        );
    }

    #[test]
    fn dirt_is_reported_by_its_place() {
        let dirty = |k: u32, image: GrayImage| {
            if k < 20 { image } else { part(image, 48..96, 24..48, |_, _, v| 80 + v / 3) }
        };
        let said = said(dirty);
        assert!(
            said.len() == 1
                && said[0]
                    .starts_with("a part of the picture (x 48 to 96 px, y 24 to 48 px) blurs in frame 120"),
            "{said:?}"
        );
        // At 5 frames/s the world changes as fast.
        assert_eq!(said_every(200, dirty), Vec::<String>::new());
    }

    #[test]
    fn pictures_that_do_not_follow_each_other_are_not_compared() {
        let mut faults = PictureFaults::default();
        let images =
            (0..8).map(picture).chain((0..8).map(|k| part(picture(k), 48..96, 24..48, |_, _, v| 40 + v / 3)));
        for (k, image) in (0_i64..).zip(images) {
            let after_a_gap = if k >= 8 { 1_000_000_000 } else { 0 };
            faults.observe(&image, k as u64, k * 100_000_000 + after_a_gap, &options());
        }
        assert_eq!(faults.describe(), Vec::<String>::new());
    }
}
