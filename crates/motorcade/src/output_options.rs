//! Options of what the tables of a run and its report show beside the estimates.

use serde::{Deserialize, Serialize};

/// Speeds and the vehicle ahead. They change no estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutputOptions {
    /// Time over which the camera's speed is taken, centred on the frame \[s\]. Chosen: a longer one smooths the speed, and braking with it.
    pub speed_time_s: f64,
    /// Speed below which no time gap and no time to collision is given \[m/s\]. Chosen: a lower one also gives times by speeds near
    /// zero, which are long and uncertain.
    pub standing_mps: f64,
    /// Path of the camera.
    pub advanced: AdvancedOutputOptions,
}

impl Default for OutputOptions {
    fn default() -> Self {
        Self { speed_time_s: 0.4, standing_mps: 0.5, advanced: AdvancedOutputOptions::default() }
    }
}

/// Path of the camera, along which the vehicle ahead is looked for. None of these numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedOutputOptions {
    /// Least distance of two points of the path \[m\]: while the camera stands no points are added. A shorter one follows tight bends more exactly
    /// and takes more time.
    pub path_spacing_m: f64,
    /// Length of path along which a vehicle ahead is looked for \[m\]: as far as vehicles are found. A longer one takes more time.
    pub look_ahead_m: f64,
}

impl Default for AdvancedOutputOptions {
    fn default() -> Self {
        Self { path_spacing_m: 1.0, look_ahead_m: 150.0 }
    }
}

impl OutputOptions {
    /// The first setting out of its range, with what it must be.
    pub(crate) fn validate(&self) -> Result<(), String> {
        for (name, value) in [("speed_time_s", self.speed_time_s), ("standing_mps", self.standing_mps)] {
            if value < 0.0 {
                return Err(format!("outputs.{name} must not be negative"));
            }
        }
        let AdvancedOutputOptions { path_spacing_m, look_ahead_m } = self.advanced;
        if !(0.01..=100.0).contains(&path_spacing_m) {
            return Err("outputs.advanced.path_spacing_m must lie between 0.01 and 100".to_owned());
        }
        if !(1.0..=10_000.0).contains(&look_ahead_m) {
            return Err("outputs.advanced.look_ahead_m must lie between 1 and 10000".to_owned());
        }
        Ok(())
    }
}
