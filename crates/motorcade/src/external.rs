//! Inputs from files in place of stages, or as help for them.

use motorcade_dataset::ExternalVehiclePose;
use motorcade_perception::KeypointTable;
use motorcade_shape::ShapePrior;

use crate::distances::Distances;
use crate::kept_map::KeptMap;
use crate::motion_source::ExternalTrajectory;

/// Inputs from files in place of stages, or as help for them; all absent by default.
#[derive(Clone, Debug, Default)]
pub struct External {
    /// In place of odometry.
    pub trajectory: Option<ExternalTrajectory>,
    /// Beside the height of the camera.
    pub distances: Option<Distances>,
    /// In place of vehicle localisation.
    pub vehicles: Option<Vec<ExternalVehiclePose>>,
    /// Keypoints of vehicles, by frame number.
    pub keypoints: Option<KeypointTable>,
    /// Places of an earlier drive, in whose world this one is expressed.
    pub map: Option<KeptMap>,
    /// Shape prior in place of the built-in one for keypoints of its number.
    pub shape_prior: Option<ShapePrior>,
}
