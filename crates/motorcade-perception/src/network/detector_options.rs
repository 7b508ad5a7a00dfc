//! Options of perception: scores, crops, suppression, regions fixed to the camera.

use super::crop_options::CropOptions;
use super::nms::SuppressionOptions;
use crate::fixed_regions::FixedRegionOptions;
use crate::road::RoadBelowOptions;

/// Options of the detectors. A change of one makes kept perceptions and checkpoints those of another run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorOptions {
    /// Vehicles of a network less certain than this are not handed out, 0 to 1. Low, because tracking rejects chance detections.
    pub min_score: f64,
    /// Score from which a box masks the scene for the camera's motion and the road, 0 to 1: weaker ones are more often shadows than vehicles.
    pub masking_score: f64,
    /// Crops, boxes of the same vehicle, and regions that are fixed to the camera.
    pub advanced: AdvancedDetectorOptions,
}

/// Crops, boxes of the same vehicle, and regions that are fixed to the camera.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedDetectorOptions {
    /// Boxes that the vehicle network looks at.
    pub crops: CropOptions,
    /// Boxes that describe the same vehicle.
    pub suppression: SuppressionOptions,
    /// Regions of the picture that are fixed to the camera.
    pub fixed: FixedRegionOptions,
    /// Least width and height of a box \[px of the frame\]: thinner ones are not vehicles. Chosen; a larger one leaves out vehicles far away.
    pub least_side_px: f64,
    /// Road below the boxes.
    pub road_below: RoadBelowOptions,
}

impl Default for AdvancedDetectorOptions {
    fn default() -> Self {
        Self {
            crops: CropOptions::default(),
            suppression: SuppressionOptions::default(),
            fixed: FixedRegionOptions::default(),
            least_side_px: 2.0,
            road_below: RoadBelowOptions::default(),
        }
    }
}

impl Default for DetectorOptions {
    fn default() -> Self {
        Self { min_score: 0.1, masking_score: 0.3, advanced: AdvancedDetectorOptions::default() }
    }
}

impl DetectorOptions {
    /// The first setting out of its range, with what it must be; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        let AdvancedDetectorOptions { crops, suppression, fixed, .. } = &self.advanced;
        for (name, value) in [
            ("min_score", self.min_score),
            ("masking_score", self.masking_score),
            ("advanced.crops.same_iou", crops.same_iou),
            ("advanced.crops.sure_heading", crops.sure_heading),
            ("advanced.crops.keypoints.min_score", crops.keypoints.min_score),
            ("advanced.crops.presence.min_score", crops.presence.min_score),
            ("advanced.suppression.same_class_iou", suppression.same_class_iou),
            ("advanced.suppression.other_class_iou", suppression.other_class_iou),
            ("advanced.suppression.any_class_iou", suppression.any_class_iou),
            ("advanced.suppression.averaged_iou", suppression.averaged_iou),
            ("advanced.fixed.most_masked", fixed.most_masked),
            ("advanced.fixed.within_vehicle", fixed.within_vehicle),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("perception.{name} must lie between 0 and 1"));
            }
        }
        for (name, value, least, most) in [
            ("advanced.fixed.least_frames", fixed.least_frames, 2, 1000),
            ("advanced.fixed.most_frames", fixed.most_frames, fixed.least_frames, 10_000),
            ("advanced.fixed.change_step_px", fixed.change_step_px, 1, 100),
            ("advanced.fixed.reach_px", fixed.reach_px, 1, 20),
            ("advanced.fixed.margin_px", fixed.margin_px, 0, 200),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("perception.{name} must lie between {least} and {most}"));
            }
        }
        let positive = [("keypoints", crops.keypoints.interval_s), ("presence", crops.presence.interval_s)];
        match positive.iter().find(|(_, interval_s)| *interval_s < 0.0) {
            Some((name, _)) => {
                Err(format!("perception.advanced.crops.{name}.interval_s must not be negative"))
            }
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
        let mut with_step = default;
        with_step.advanced.fixed.change_step_px = 0;
        assert!(with_step.validate().unwrap_err().contains("change_step_px"));
    }
}
