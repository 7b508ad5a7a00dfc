//! Options of perception: scores, crops, suppression, regions fixed to the camera.

use super::crop_options::CropOptions;
use super::nms::SuppressionOptions;
use crate::fixed_regions::FixedRegionOptions;

/// Options of the detectors. A change of one makes kept perceptions and checkpoints those of another run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorOptions {
    /// Vehicles of a network less certain than this are not handed out, 0 to 1. Low, because tracking rejects chance detections.
    pub min_score: f64,
    /// Score from which a box masks the scene for the camera's motion and the road, 0 to 1: weaker ones are more often shadows than vehicles.
    pub masking_score: f64,
    /// Boxes that the vehicle network looks at.
    pub crops: CropOptions,
    /// Boxes that describe the same vehicle.
    pub suppression: SuppressionOptions,
    /// Regions of the picture that are fixed to the camera.
    pub fixed: FixedRegionOptions,
}

impl Default for DetectorOptions {
    fn default() -> Self {
        Self {
            min_score: 0.1,
            masking_score: 0.3,
            crops: CropOptions::default(),
            suppression: SuppressionOptions::default(),
            fixed: FixedRegionOptions::default(),
        }
    }
}

impl DetectorOptions {
    /// The first setting out of its range, with what it must be; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        let (crops, suppression, fixed) = (&self.crops, &self.suppression, &self.fixed);
        for (name, value) in [
            ("min_score", self.min_score),
            ("masking_score", self.masking_score),
            ("crops.same_iou", crops.same_iou),
            ("crops.keypoints.min_score", crops.keypoints.min_score),
            ("crops.presence.min_score", crops.presence.min_score),
            ("suppression.same_class_iou", suppression.same_class_iou),
            ("suppression.other_class_iou", suppression.other_class_iou),
            ("suppression.any_class_iou", suppression.any_class_iou),
            ("suppression.averaged_iou", suppression.averaged_iou),
            ("fixed.most_masked", fixed.most_masked),
            ("fixed.within_vehicle", fixed.within_vehicle),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("perception.{name} must lie between 0 and 1"));
            }
        }
        for (name, value, least, most) in [
            ("fixed.least_frames", fixed.least_frames, 2, 1000),
            ("fixed.most_frames", fixed.most_frames, fixed.least_frames, 10_000),
            ("fixed.change_step_px", fixed.change_step_px, 1, 100),
            ("fixed.reach_px", fixed.reach_px, 1, 20),
            ("fixed.margin_px", fixed.margin_px, 0, 200),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("perception.{name} must lie between {least} and {most}"));
            }
        }
        let positive = [("keypoints", crops.keypoints.interval_s), ("presence", crops.presence.interval_s)];
        match positive.iter().find(|(_, interval_s)| *interval_s < 0.0) {
            Some((name, _)) => Err(format!("perception.crops.{name}.interval_s must not be negative")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_their_range_are_named() {
        let default = DetectorOptions::default();
        assert_eq!(default.validate(), Ok(()));
        let with_score = DetectorOptions { min_score: 1.5, ..default };
        assert!(with_score.validate().unwrap_err().contains("perception.min_score"));
        let fixed = FixedRegionOptions { change_step_px: 0, ..default.fixed };
        let with_step = DetectorOptions { fixed, ..default };
        assert!(with_step.validate().unwrap_err().contains("change_step_px"));
    }
}
