//! Options of the checks of what goes in.

use motorcade_calibrate::FocalCheckOptions;
use serde::{Deserialize, Serialize};

use crate::picture_faults::PictureFaultOptions;

/// Checks of what goes in. They tell faults by warnings and change no result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckOptions {
    /// Times of the frames.
    pub clock: ClockJumpOptions,
    /// Focal length, in drives that are estimated as a whole.
    pub focal_length: FocalCheckOptions,
    /// Pictures.
    pub pictures: PictureFaultOptions,
}

impl CheckOptions {
    /// The first setting out of its range, with what it must be.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let clock = &self.clock;
        for (name, value) in [("late_intervals", clock.late_intervals), ("late_s", clock.late_s)] {
            if value <= 0.0 {
                return Err(format!("checks.clock.{name} must be positive"));
            }
        }
        if clock.named == 0 {
            return Err("checks.clock.named must be at least 1".to_owned());
        }
        self.focal_length.validate().map_err(|problem| format!("checks.focal_length.{problem}"))?;
        self.pictures.validate().map_err(|problem| format!("checks.pictures.{problem}"))
    }
}

/// Frames that come late, which are told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClockJumpOptions {
    /// Median intervals of the drive beyond which a frame comes late. Less tells single frames that a recorder dropped.
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
