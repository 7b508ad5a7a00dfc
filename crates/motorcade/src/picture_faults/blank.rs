//! Parts of a picture that lose all texture within a frame: a stream that broke, something in front of the lens.

use super::cells::Cells;
use super::options::PictureFaultOptions;
use crate::frame_list::FrameList;

/// Frames in which a part of the picture is blank.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct BlankParts {
    frames: FrameList,
    /// Largest share.
    largest: f64,
    /// Cells that lost their texture, while a part is blank.
    lost: Vec<bool>,
}

impl BlankParts {
    /// Compares two pictures that follow each other; true where a part of this one is blank.
    pub fn observe(
        &mut self,
        number: u64,
        before: &Cells,
        now: &Cells,
        options: &PictureFaultOptions,
    ) -> bool {
        let blank = |k: usize| f64::from(now.deviations[k]) < options.blank_grey;
        let textured = |k: usize| f64::from(before.deviations[k]) > options.textured_grey;
        self.lost.resize(now.len(), false);
        for (k, lost) in self.lost.iter_mut().enumerate() {
            *lost = blank(k) && (*lost || textured(k));
        }
        let share = self.lost.iter().filter(|lost| **lost).count() as f64 / now.len().max(1) as f64;
        let found = share > options.blank_share;
        if found {
            self.frames.push(number);
            self.largest = self.largest.max(share);
        } else {
            self.lost.clear();
        }
        found
    }

    /// A warning that names the frames.
    pub fn describe(&self) -> Option<String> {
        let named = self.frames.describe()?;
        Some(format!(
            "up to {:.0} % of the picture lost all texture from one frame to the next, in {named}: a broken stream, or something in front of the lens; what is there is not seen",
            100.0 * self.largest
        ))
    }
}
