//! Everything that is fixed over a drive.

use motorcade_geometry::PinholeCamera;

use crate::config::Config;
use crate::external::External;

/// Everything that is fixed over a drive.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Intrinsics of the (undistorted) frames.
    pub camera: PinholeCamera,
    /// Height of the camera above the road \[m\].
    pub height_m: f64,
    /// True where that height is a guess, to be replaced by the one by vehicles at the end of the drive.
    pub height_unknown: bool,
    /// Configuration.
    pub config: Config,
    /// Inputs from files in place of stages.
    pub external: External,
    /// Threads of the solver at the end of a drive; results do not depend on it.
    pub threads: usize,
}

impl Settings {
    /// Default configuration, no external inputs, one thread.
    pub fn new(camera: PinholeCamera, height_m: f64) -> Self {
        let (config, external) = (Config::default(), External::default());
        Self { camera, height_m, height_unknown: false, config, external, threads: 1 }
    }

    /// Without the stated height: it is estimated from the sizes of cars at the end of the drive.
    #[must_use]
    pub fn with_height_by_vehicles(self) -> Self {
        Self { height_m: self.config.scale.height.guess_m, height_unknown: true, ..self }
    }

    /// True when the camera's motion comes in metres.
    pub(crate) fn metric(&self) -> bool {
        self.external.trajectory.as_ref().is_some_and(|t| t.metric)
    }
}
