//! Options of the checks of what goes in.

use motorcade_calibrate::FocalCheckOptions;
use serde::{Deserialize, Serialize};

use crate::picture_faults::PictureFaultOptions;

/// Checks of what goes in. They report faults by warnings and change no result, but for repeated pictures, whose poses are bridged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckOptions {
    /// Limits of each check.
    pub advanced: AdvancedCheckOptions,
}

/// Limits of each check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedCheckOptions {
    /// Times of the frames.
    pub clock: ClockJumpOptions,
    /// Boxes of vehicles.
    pub detections: DetectionFaultOptions,
    /// Focal length, in drives that are estimated as a whole.
    pub focal_length: FocalCheckOptions,
    /// Pictures.
    pub pictures: PictureFaultOptions,
    /// Pictures that show the one before again.
    pub repeated_frames: RepeatedFrameOptions,
    /// Pictures in the wrong order.
    pub swapped_frames: SwappedFrameOptions,
    /// Settings and results that are possible but rarely meant.
    pub plausibility: PlausibilityOptions,
}

impl CheckOptions {
    /// The first setting out of its range, with what it must be.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let advanced = &self.advanced;
        let clock = &advanced.clock;
        for (name, value) in [("late_intervals", clock.late_intervals), ("late_s", clock.late_s)] {
            if value <= 0.0 {
                return Err(format!("checks.advanced.clock.{name} must be positive"));
            }
        }
        if clock.named == 0 {
            return Err("checks.advanced.clock.named must be at least 1".to_owned());
        }
        let detections = &advanced.detections;
        for (name, count) in [("least_boxes", detections.least_boxes), ("named", detections.named)] {
            if count == 0 {
                return Err(format!("checks.advanced.detections.{name} must be at least 1"));
            }
        }
        advanced
            .focal_length
            .validate()
            .map_err(|problem| format!("checks.advanced.focal_length.{problem}"))?;
        advanced.pictures.validate().map_err(|problem| format!("checks.advanced.pictures.{problem}"))?;
        if advanced.repeated_frames.step_px == 0 {
            return Err("checks.advanced.repeated_frames.step_px must be at least 1".to_owned());
        }
        if advanced.swapped_frames.named == 0 {
            return Err("checks.advanced.swapped_frames.named must be at least 1".to_owned());
        }
        Ok(())
    }
}

/// Frames that come late, which are reported.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClockJumpOptions {
    /// Median intervals of the drive beyond which a frame comes late. Less reports single frames that a recorder dropped.
    pub late_intervals: f64,
    /// Shortest interval that is late \[s\]: live sources pause for less.
    pub late_s: f64,
    /// Jumps that the warning names; the rest are counted.
    pub named: usize,
}

impl Default for ClockJumpOptions {
    fn default() -> Self {
        Self { late_intervals: 10.0, late_s: 1.0, named: 3 }
    }
}

/// Boxes that no sound detector gives. Chosen, not measured: of KITTI's labels and the program's own networks none is reported.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionFaultOptions {
    /// Intersection over union beyond which a box lies on another one. A smaller one takes vehicles that hide each other for one.
    pub double_iou: f64,
    /// Share of the boxes that lie on another one from which vehicles are found twice.
    pub doubled_share: f64,
    /// Intersection over union beyond which boxes of two frames in a row are those of one vehicle.
    pub same_iou: f64,
    /// Share of such pairs with two identities from which identities are not those of vehicles: trackers confuse a few.
    pub changed_share: f64,
    /// Least number of boxes that lie on others, or change their identity, which is spoken of.
    pub least_boxes: usize,
    /// Shortest span without boxes \[s\]. A shorter one reports moments in which vehicles hide.
    pub gap_s: f64,
    /// Frames without boxes that such a span has more than, at any frame rate.
    pub gap_frames: usize,
    /// Least number of large boxes before and after a span: one vehicle may well leave and another one come.
    pub gap_boxes: usize,
    /// Least height of a large box, as a share of the picture's: 25 px of KITTI's 375. Smaller ones are seen at times only.
    pub least_height_share: f64,
    /// Spans that the warning names; the rest are counted.
    pub named: usize,
}

impl Default for DetectionFaultOptions {
    fn default() -> Self {
        Self {
            double_iou: 0.7,
            doubled_share: 0.2,
            same_iou: 0.5,
            changed_share: 0.3,
            least_boxes: 20,
            gap_s: 1.0,
            gap_frames: 4,
            gap_boxes: 2,
            least_height_share: 1.0 / 15.0,
            named: 3,
        }
    }
}

/// Frames that show the frame before again: ten pictures a second in a video of thirty, or a picture that is frozen for seconds. Their poses are bridged.
/// None of these numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RepeatedFrameOptions {
    /// Distance of the pixels by which two pictures are compared, row after row \[px\]. A larger one is quicker and misses small changes; 7 divides
    /// no usual width, so that all columns are compared.
    pub step_px: usize,
    /// Share of the usual difference between two frames up to which a frame is a repetition: coding anew changes a few pixels. A larger one
    /// takes slow motion for repetition.
    pub most_share: f64,
    /// The same limit as a mean difference \[grey levels\]: beyond it a picture has changed, whatever is usual.
    pub most_grey: f64,
    /// Usual difference from which the camera moves \[grey levels\]: more than the noise of a sensor. A larger one finds no repetitions in dark and
    /// plain drives.
    pub moving_grey: f64,
    /// Longest time between two frames that differ \[s\]: a car that is seen to move does not stop within it, and what lasts longer is a standstill. A
    /// longer one finds repetitions of slower pictures, and bridges the begin of more standstills.
    pub longest_s: f64,
    /// Weight of a new difference in the usual one. A larger one follows changes of speed sooner.
    pub rate: f64,
    /// Share of the usual difference up to which a picture is frozen: the picture of a standing camera has noise.
    pub frozen_share: f64,
    /// Share of the usual difference from which two frames show full motion, from which a picture may freeze. A smaller one takes sensors without
    /// noise that come to rest for frozen.
    pub motion_share: f64,
    /// Longest interval within which a car does not stop from full motion \[s\]. A longer one finds frozen pictures at lower frame rates.
    pub abrupt_s: f64,
}

impl Default for RepeatedFrameOptions {
    fn default() -> Self {
        Self {
            step_px: 7,
            most_share: 0.15,
            most_grey: 1.5,
            moving_grey: 2.0,
            longest_s: 0.3,
            rate: 0.2,
            frozen_share: 0.02,
            motion_share: 0.5,
            abrupt_s: 0.15,
        }
    }
}

/// Frames in the wrong order: the camera goes ahead, back and ahead again within three frames. None of these numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SwappedFrameOptions {
    /// Change of velocity over the time of a step beyond which no vehicle is \[m/s²\]: three times an emergency stop. A smaller one takes errors of slow
    /// motion for swapped frames.
    pub most_acceleration_mps2: f64,
    /// Cosine of the angle between two steps below which they lead opposite ways. A larger one finds swapped frames in tighter bends, and
    /// takes more errors for some.
    pub opposite_cosine: f64,
    /// Step over the one back, least and greatest, where two neighbours were swapped: 2 for an even speed, less and more for one that changes.
    pub ahead_over_back: [f64; 2],
    /// Pairs that the warning names; the rest are counted.
    pub named: usize,
}

impl Default for SwappedFrameOptions {
    fn default() -> Self {
        Self { most_acceleration_mps2: 30.0, opposite_cosine: -0.8, ahead_over_back: [1.3, 3.5], named: 5 }
    }
}

/// Settings and results that are possible but rarely meant. Wider limits report less, narrower ones also what is meant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlausibilityOptions {
    /// Least and greatest height of a camera above the road \[m\]: in cars, vans and lorries.
    pub heights_m: [f64; 2],
    /// Field of view beyond which lenses are no pinholes \[rad\]: 120°.
    pub widest_rad: f64,
    /// Largest difference of the focal lengths of square pixels, as a share.
    pub focal_difference: f64,
    /// Speed beyond which no road vehicle is \[m/s\].
    pub fastest_mps: f64,
}

impl Default for PlausibilityOptions {
    fn default() -> Self {
        Self { heights_m: [0.3, 5.0], widest_rad: 2.1, focal_difference: 0.05, fastest_mps: 100.0 }
    }
}
