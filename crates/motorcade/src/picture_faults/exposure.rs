//! Jumps of exposure: all of a picture is brighter or darker by one factor.

use motorcade_geometry::robust::upper_median_by;

use super::cells::Cells;
use super::options::PictureFaultOptions;
use crate::frame_list::FrameList;

/// Frames in which exposure jumped.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
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
        let Some(change) = upper_median_by(&mut self.ratios, f32::total_cmp) else { return };
        self.ratios.iter_mut().for_each(|r| *r = (*r - change).abs());
        let spread = upper_median_by(&mut self.ratios, f32::total_cmp).unwrap_or_default();
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
