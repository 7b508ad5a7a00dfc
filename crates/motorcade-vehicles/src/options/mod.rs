//! Options of the vehicle stage: one choice of the user, and the advanced ones of each step.

mod box_fit;
mod class;
mod external;
mod heading;
mod hypothesis;
mod met_again;
mod motion;
mod size;

pub use box_fit::BoxFitOptions;
pub use class::ClassOptions;
pub use external::{ExternalViewOptions, KeypointViewOptions};
pub use heading::HeadingOptions;
pub use hypothesis::HypothesisOptions;
pub use met_again::MetAgainOptions;
pub use motion::{KinematicStateOptions, MotionOptions};
pub use size::SizeOptions;

/// Side of the road traffic keeps to. It decides only which way a parked vehicle is assumed to face, because a box does not
/// distinguish front from rear.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum TrafficSide {
    /// Most of the world.
    #[default]
    Right,
    /// Britain, Japan, India, Australia, southern Africa.
    Left,
}

/// Options of the vehicle stage.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleOptions {
    /// Side of the road traffic keeps to.
    pub traffic_side: TrafficSide,
    /// Noise models and gates of each step.
    pub advanced: AdvancedVehicleOptions,
}

impl VehicleOptions {
    /// The first setting out of its range, with what it must be.
    ///
    /// # Errors
    /// Name and range of that setting.
    pub fn validate(&self) -> Result<(), String> {
        let AdvancedVehicleOptions { class, kinematic_state, keypoints, met_again, .. } = &self.advanced;
        let probability = |p: &f64| *p > 0.0 && *p <= 1.0;
        if !class.shares.iter().chain(class.confusion.iter().flatten()).all(probability) {
            let text = "vehicles.advanced.class: shares and confusion must lie above 0 and at most at 1";
            return Err(text.to_owned());
        }
        if kinematic_state.least_road_boxes < 1 {
            return Err("vehicles.advanced.kinematic_state.least_road_boxes must be at least 1".to_owned());
        }
        if kinematic_state.line_dof <= 0.0 || kinematic_state.line_least_scale <= 0.0 {
            let text = "vehicles.advanced.kinematic_state: line_dof and line_least_scale must be positive";
            return Err(text.to_owned());
        }
        if !(0.0..=0.5).contains(&kinematic_state.undecided_from) {
            let text = "vehicles.advanced.kinematic_state.undecided_from must lie between 0 and 0.5";
            return Err(text.to_owned());
        }
        if self.advanced.box_fit.common_height_sigma_px < 0.0 {
            return Err("vehicles.advanced.box_fit.common_height_sigma_px must not be negative".to_owned());
        }
        if self.advanced.size.prior_factor <= 0.0 {
            return Err("vehicles.advanced.size.prior_factor must be positive".to_owned());
        }
        if keypoints.road_height_sigma_m <= 0.0 {
            return Err("vehicles.advanced.keypoints.road_height_sigma_m must be positive".to_owned());
        }
        met_again.validate()?;
        keypoints.fit.validate()
    }
}

/// Noise models and gates of the vehicle stage, by step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedVehicleOptions {
    /// Time over which errors of a vehicle's views are correlated \[s\]: views closer together share their information, so that
    /// it grows with time and not with the frame rate. At 10 frames/s views count as independent, beside the common errors of size
    /// and plane; the limits on independent views were chosen there.
    pub correlation_time_s: f64,
    /// Position and size from one box.
    pub box_fit: BoxFitOptions,
    /// Size shared by the frames of a track.
    pub size: SizeOptions,
    /// Motion model and smoothing.
    pub motion: MotionOptions,
    /// Moving or static.
    pub kinematic_state: KinematicStateOptions,
    /// Headings.
    pub heading: HeadingOptions,
    /// Choice between heading hypotheses.
    pub hypothesis: HypothesisOptions,
    /// Choice of the class.
    pub class: ClassOptions,
    /// Views from keypoints.
    pub keypoints: KeypointViewOptions,
    /// Views from vehicle poses of a file.
    pub external: ExternalViewOptions,
    /// Standing vehicles that are passed again.
    pub met_again: MetAgainOptions,
}

impl Default for AdvancedVehicleOptions {
    fn default() -> Self {
        Self {
            correlation_time_s: 0.1,
            box_fit: BoxFitOptions::default(),
            size: SizeOptions::default(),
            motion: MotionOptions::default(),
            kinematic_state: KinematicStateOptions::default(),
            heading: HeadingOptions::default(),
            hypothesis: HypothesisOptions::default(),
            class: ClassOptions::default(),
            keypoints: KeypointViewOptions::default(),
            external: ExternalViewOptions::default(),
            met_again: MetAgainOptions::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_of_classes_are_positive() {
        let mut options = VehicleOptions::default();
        assert_eq!(options.validate(), Ok(()));
        options.advanced.class.confusion[2][1] = 0.0;
        assert!(options.validate().unwrap_err().contains("class"));
    }
}
