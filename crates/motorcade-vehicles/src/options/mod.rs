//! Options of the vehicle stage: one choice of the user, and the advanced ones of each step.

mod box_fit;
mod external;
mod heading;
mod hypothesis;
mod motion;
mod size;

pub use box_fit::BoxFitOptions;
pub use external::{ExternalViewOptions, KeypointViewOptions};
pub use heading::HeadingOptions;
pub use hypothesis::HypothesisOptions;
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

/// Noise models and gates of the vehicle stage, by step.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedVehicleOptions {
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
    /// Views from keypoints.
    pub keypoints: KeypointViewOptions,
    /// Views from vehicle poses of a file.
    pub external: ExternalViewOptions,
}
