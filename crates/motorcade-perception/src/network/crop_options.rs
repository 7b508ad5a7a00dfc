//! Options of the boxes that are cropped.

use crate::detection::Detection;

/// Choice of the boxes that are cropped.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CropOptions {
    /// Cars and vans whose keypoints are looked for.
    pub keypoints: CropChoice,
    /// All other boxes: lorries, buses, and cars too small for keypoints, of which the network gives the presence alone.
    pub presence: CropChoice,
    /// Overlap (IoU) with a box cropped before from which it is the same vehicle.
    pub same_iou: f64,
    /// Probability of the heading of a crop below which the network sees the crop in a mirror too, and the mean of both counts: the errors of one are not
    /// those of the other. At 0.85 a fifth of the crops of KITTI 0005 and 0003. A larger one costs more time, up to that of every crop again.
    pub sure_heading: f64,
}

/// Limits of the boxes that are cropped for one purpose.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CropChoice {
    /// Least height of a box \[px\]: below, the crop shows less than the box. Least width: half of it.
    pub min_height_px: f64,
    /// True for pixels of the detector's input, false for those of the picture.
    pub input_pixels: bool,
    /// Least score of a box.
    pub min_score: f64,
    /// Crops a frame at most, largest first: each costs time.
    pub max_crops: usize,
    /// Time after which a box is cropped again \[s\]: in between, a network errs as it did before.
    pub interval_s: f64,
}

impl CropChoice {
    pub(super) fn includes(&self, detection: &Detection) -> bool {
        let pixel = if self.input_pixels { detection.pixel_size } else { 1.0 };
        let least_px = self.min_height_px * pixel;
        let Detection { bbox, score, .. } = detection;
        *score >= self.min_score && bbox.height() >= least_px && bbox.width() >= 0.5 * least_px
    }
}

impl Default for CropOptions {
    fn default() -> Self {
        let keypoints = CropChoice {
            min_height_px: 20.0,
            input_pixels: false,
            min_score: 0.3,
            max_crops: 8,
            interval_s: 0.15,
        };
        // The height is that of the boxes that the presence was learned from; score and number are a matter of time.
        let presence = CropChoice {
            min_height_px: 12.0,
            input_pixels: true,
            min_score: 0.2,
            max_crops: 2,
            interval_s: 0.5,
        };
        Self { keypoints, presence, same_iou: 0.5, sure_heading: 0.85 }
    }
}
