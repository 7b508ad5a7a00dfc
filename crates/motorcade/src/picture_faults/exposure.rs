//! Jumps of exposure: all of a picture is brighter or darker by one factor.

use super::cells::Cells;
use super::options::PictureFaultOptions;
use crate::frame_list::FrameList;

/// Frames in which exposure jumped.
#[derive(Debug, Default)]
pub(super) struct ExposureJumps {
    frames: FrameList,
    /// Largest factor, brighter or darker.
    largest: f32,
    ratios: Vec<f32>,
}

impl ExposureJumps {
    /// Compares two pictures that follow each other.
    pub fn observe(&mut self, number: u64, before: &Cells, now: &Cells, options: &PictureFaultOptions) {
        let floor = options.exposure_floor_grey as f32;
        let ratio = |(a, b): (&f32, &f32)| ((b + floor) / (a + floor)).ln();
        self.ratios.clear();
        self.ratios.extend(before.means.iter().zip(&now.means).map(ratio));
        let Some(change) = median(&mut self.ratios) else { return };
        self.ratios.iter_mut().for_each(|r| *r = (*r - change).abs());
        let spread = median(&mut self.ratios).unwrap_or_default();
        let factor = change.abs().exp();
        if f64::from(factor) > options.exposure_factor && f64::from(spread) < options.exposure_spread {
            self.frames.push(number);
            self.largest = self.largest.max(factor);
        }
    }

    /// A warning that names the frames.
    pub fn describe(&self) -> Option<String> {
        let named = self.frames.describe()?;
        Some(format!(
            "exposure jumps: all of the picture is brighter or darker than just before, up to {:.1} times, in {named}; lock the exposure of the camera where that is possible",
            self.largest
        ))
    }
}

/// The median; the values are reordered.
pub(super) fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
