//! Builds the object that takes frames.

use motorcade_dataset::HEIGHT_RANGE_M;
use motorcade_geometry::PinholeCamera;
use motorcade_perception::{KeypointDetector, Perception, RoadSegmenter, VehicleDetector};

use super::Motorcade;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::estimator::SlidingEstimator;
use crate::external::External;
use crate::fixed_parts::FixedParts;
use crate::front_end::FrontEnd;
use crate::picture_faults::PictureFaults;
use crate::plausibility;
use crate::repeated_frames::RepeatedFrames;
use crate::settings::Settings;

/// Builds a [`Motorcade`].
pub struct MotorcadeBuilder {
    camera: PinholeCamera,
    height_m: Option<f64>,
    height_unknown: bool,
    focal_sigma: f64,
    readout_s: Option<f64>,
    config: Config,
    external: External,
    perception: Perception,
    threads: usize,
}

impl MotorcadeBuilder {
    /// For a camera, with the default configuration.
    pub(super) fn new(camera: PinholeCamera) -> Self {
        let (config, external, perception) = (Config::default(), External::default(), Perception::none());
        Self {
            camera,
            height_m: None,
            height_unknown: false,
            focal_sigma: 0.0,
            readout_s: None,
            config,
            external,
            perception,
            threads: 1,
        }
    }

    /// Height of the camera above the road \[m\]; all lengths are proportional to it.
    #[must_use]
    pub fn height_m(mut self, height_m: f64) -> Self {
        self.height_m = Some(height_m);
        self.height_unknown = false;
        self
    }
    /// The height is not known: [`finish`](Motorcade::finish) estimates it from the sizes of cars, with a standard deviation that enters
    /// all covariances. Until then, and online, lengths assume `scale.height.guess_m`.
    #[must_use]
    pub fn height_by_vehicles(mut self) -> Self {
        self.height_m = None;
        self.height_unknown = true;
        self
    }
    /// Standard deviation of the logarithm of the focal length: all lengths are proportional to it, so it enters their covariances.
    #[must_use]
    pub fn focal_sigma(mut self, focal_sigma: f64) -> Self {
        self.focal_sigma = focal_sigma;
        self
    }
    /// Time from the reading of a picture's first row to that of its last \[s\], of a rolling shutter; in place of `odometry.readout_s` and
    /// `road.readout_s` of the configuration.
    #[must_use]
    pub fn readout_s(mut self, readout_s: f64) -> Self {
        self.readout_s = Some(readout_s);
        self
    }
    /// Configuration in place of the default one.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.config = config;
        self
    }
    /// Inputs from files in place of stages.
    #[must_use]
    pub fn external(mut self, external: External) -> Self {
        self.external = external;
        self
    }
    /// All detectors at once.
    #[must_use]
    pub fn perception(mut self, perception: Perception) -> Self {
        self.perception = perception;
        self
    }
    /// A detector of vehicles.
    #[must_use]
    pub fn detector(mut self, detector: impl VehicleDetector + 'static) -> Self {
        self.perception = self.perception.with_detector(detector);
        self
    }
    /// A segmenter of the road.
    #[must_use]
    pub fn segmenter(mut self, segmenter: impl RoadSegmenter + 'static) -> Self {
        self.perception = self.perception.with_segmenter(segmenter);
        self
    }
    /// A detector of keypoints.
    #[must_use]
    pub fn keypoints(mut self, detector: impl KeypointDetector + 'static) -> Self {
        self.perception = self.perception.with_keypoints(detector);
        self
    }
    /// Threads of the solver at the end of a drive; results do not depend on it.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Ready for the first frame.
    ///
    /// # Errors
    /// No height, or one that no camera has; intrinsics that are none; a configuration out of range; distances of another sensor
    /// where metres are given.
    pub fn build(self) -> Result<Motorcade> {
        let Self { camera, height_m, height_unknown, focal_sigma, readout_s, mut config, .. } = self;
        let (external, perception, threads) = (self.external, self.perception, self.threads);
        if let Some(readout_s) = readout_s {
            (config.odometry.readout_s, config.road.readout_s) = (readout_s, readout_s);
        }
        let height_m = height_m.or(height_unknown.then_some(config.scale.height.guess_m));
        let height_m = height_m.filter(|h| HEIGHT_RANGE_M.contains(h)).ok_or_else(|| {
            Error::Config("the height of the camera above the road must lie in [0.01, 1000] m".to_owned())
        })?;
        camera.validate().map_err(|e| Error::Config(e.to_string()))?;
        config.validate().map_err(Error::Config)?;
        let metric = &mut config.scale.advanced.metric;
        metric.bias_sigma = metric.bias_sigma.hypot(focal_sigma);
        metric.profile.reach_heights = config.road.far_heights;
        let in_metres = external.trajectory.as_ref().is_some_and(|trajectory| trajectory.metric);
        if external.distances.is_some() && (in_metres || !config.scale.smoothed) {
            return Err(Error::Config(
                "speeds and GPS tracks help a scale that is smoothed over time: not a trajectory in metres, not scale.smoothed = false \
                 (preset paper)"
                    .to_owned(),
            ));
        }
        if external.map.is_some() && !config.loops.enabled {
            return Err(Error::Config(
                "a map needs places, which loops.enabled = false (preset paper) switches off".to_owned(),
            ));
        }
        let settings = Settings { camera, height_m, height_unknown, config, external, threads };
        let mut front_end = FrontEnd::new(&settings);
        if focal_sigma > 0.0 {
            front_end.trust_focal_length();
        }
        front_end.record_mut().detects_vehicles |= perception.detects_vehicles();
        let checks = &settings.config.checks.advanced;
        let doubts = plausibility::of_camera(&settings.camera, settings.height_m, &checks.plausibility);
        front_end.record_mut().warnings.extend(doubts);
        let (repeated, pictures) = (RepeatedFrames::new(checks.repeated_frames), PictureFaults::default());
        let sliding = SlidingEstimator::new(&settings);
        let Config { run, perception: detectors, .. } = &settings.config;
        let fixed = FixedParts::new(run.fixed_regions, detectors.advanced.fixed);
        let (last_picture, resumed) = (None, None);
        Ok(Motorcade {
            settings,
            perception,
            front_end,
            fixed,
            repeated,
            pictures,
            sliding,
            last_picture,
            resumed,
        })
    }
}
