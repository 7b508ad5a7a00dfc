//! Options of the checks of pictures.

use serde::{Deserialize, Serialize};

/// Faults of pictures that are reported: jumps of exposure, parts without texture, parts that blur. Each compares cells of neighbouring pictures; limits
/// lie between those of six clean drives (five of them real) and of the faults of `scripts/faults.py` (BENCHMARK.md, "Broken input").
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PictureFaultOptions {
    /// Cells across a picture. More find smaller faults, and take passing objects for some.
    pub columns: usize,
    /// Smallest side of a cell \[px\], which small pictures have fewer of: gradients of fewer pixels are noise. Chosen, not measured.
    pub least_cell_px: usize,
    /// Longest time between two pictures that are compared \[s\]: after longer ones the scene has changed by itself.
    pub longest_s: f64,
    /// Factor of brightness between two pictures from which on exposure jumped; clean drives have 1.10 at most. Larger misses small jumps.
    pub exposure_factor: f64,
    /// Largest median deviation of the cells' log factors from their median: cells of one exposure change together (0.13 in a real street),
    /// those of a covered picture do not (0.3).
    pub exposure_spread: f64,
    /// Brightness that is added before the comparison \[grey levels\]: factors of dark cells are noise. Chosen, not measured: a larger one misses jumps
    /// of dark pictures.
    pub exposure_floor_grey: f64,
    /// Standard deviation of grey levels from which on a cell has texture \[grey levels\].
    pub textured_grey: f64,
    /// Standard deviation below which it has none \[grey levels\]: less than the noise of a sensor.
    pub blank_grey: f64,
    /// Share of the cells that must lose their texture within a frame; clean drives have 0.03 at most (glare).
    pub blank_share: f64,
    /// Pictures before and after a blur begins that must all differ. More are surer and miss blurs near the ends of a drive.
    pub blur_frames: usize,
    /// Longest time between two pictures for a search for blur \[s\]: between pictures further apart most of what is near has changed. A motorway at 5
    /// frames/s was taken for dirt; clean drives at 10 to 25 were not, and smears were found at 10.
    pub blur_longest_s: f64,
    /// Gradients of a blurred cell over those before, relative to the whole picture, at most.
    pub blur_ratio: f64,
    /// Gradient that is added before the comparison \[grey levels\]: plain cells have noise alone.
    pub blur_floor_grey: f64,
    /// Share of connected cells that must blur in one frame and in no neighbouring one; clean drives have 0.024 at most, a smear of a ninth
    /// of the picture 0.08 to 0.1.
    pub blur_share: f64,
}

impl Default for PictureFaultOptions {
    fn default() -> Self {
        Self {
            columns: 24,
            least_cell_px: 8,
            longest_s: 0.25,
            exposure_factor: 1.3,
            exposure_spread: 0.2,
            exposure_floor_grey: 4.0,
            textured_grey: 4.0,
            blank_grey: 1.0,
            blank_share: 0.1,
            blur_frames: 4,
            blur_longest_s: 0.15,
            blur_ratio: 0.7,
            blur_floor_grey: 0.3,
            blur_share: 0.045,
        }
    }
}

impl PictureFaultOptions {
    /// The first setting out of its range, with what it must be.
    pub(crate) fn validate(&self) -> Result<(), String> {
        for (name, value, most) in [
            ("columns", self.columns, 200),
            ("least_cell_px", self.least_cell_px, 200),
            ("blur_frames", self.blur_frames, 100),
        ] {
            if !(2..=most).contains(&value) {
                return Err(format!("{name} must lie between 2 and {most}"));
            }
        }
        for (name, value, least) in [
            ("longest_s", self.longest_s, 0.0),
            ("exposure_factor", self.exposure_factor, 1.0),
            ("exposure_spread", self.exposure_spread, 0.0),
            ("exposure_floor_grey", self.exposure_floor_grey, 0.0),
            ("textured_grey", self.textured_grey, 0.0),
            ("blank_grey", self.blank_grey, 0.0),
            ("blank_share", self.blank_share, 0.0),
            ("blur_longest_s", self.blur_longest_s, 0.0),
            ("blur_ratio", self.blur_ratio, 0.0),
            ("blur_floor_grey", self.blur_floor_grey, 0.0),
            ("blur_share", self.blur_share, 0.0),
        ] {
            if value <= least {
                return Err(format!("{name} must be more than {least}"));
            }
        }
        Ok(())
    }
}
