//! The detectors of a run, together.

use std::path::PathBuf;

use motorcade_dataset::Frame;

use crate::detectors::{KeypointDetector, RoadSegmenter, VehicleDetector};
use crate::error::{Error, Result};
use crate::files::{Checkpoint, DetectionTable, KeptObservations, RoadMaskFolder, SkippedFrame};
use crate::models::{ModelSet, ModelSource};
use crate::network::ModelOptions;
use crate::observations::Observations;
use crate::recording::Descriptions;

/// Networks and files to open. Files take the place of networks; with neither there is no detector.
#[derive(Clone, Debug, Default)]
pub struct PerceptionOptions {
    /// Networks.
    pub models: ModelSource,
    /// File of detections.
    pub detections: Option<PathBuf>,
    /// Folder of road masks.
    pub road_masks: Option<PathBuf>,
    /// True leaves the network for keypoints out: they come from elsewhere.
    pub without_keypoints: bool,
    /// Options of inference.
    pub networks: ModelOptions,
}

/// The detectors of a run; each may be missing.
#[derive(Default)]
pub struct Perception {
    vehicles: Option<Box<dyn VehicleDetector>>,
    road: Option<Box<dyn RoadSegmenter>>,
    keypoints: Option<Box<dyn KeypointDetector>>,
    kept: Option<KeptObservations>,
    checkpoint: Option<Checkpoint>,
}

impl std::fmt::Debug for Perception {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (vehicles, road) = self.describe();
        f.debug_struct("Perception").field("vehicles", &vehicles).field("road", &road).finish()
    }
}

impl Perception {
    /// No detectors.
    pub fn none() -> Self {
        Self::default()
    }

    /// Opens files and networks for frames of this size (width, height) \[px\].
    ///
    /// # Errors
    /// A file that does not read; a folder of networks without a usable manifest; a network that does not load.
    pub fn open(options: &PerceptionOptions, image_size: (u32, u32)) -> Result<Self> {
        // With all of it given no network inside the program has to be loaded.
        let given = options.detections.is_some() && options.road_masks.is_some() && options.without_keypoints;
        let needed = !given || matches!(options.models, ModelSource::Folder(_));
        let source = if needed { &options.models } else { &ModelSource::None };
        let set = ModelSet::open(source, image_size, &options.networks)?;
        let keypoints = set.keypoints.filter(|_| !options.without_keypoints);
        let mut perception = Self { vehicles: set.vehicles, road: set.road, keypoints, ..Self::default() };
        if let Some(path) = &options.detections {
            perception = perception.with_detector(DetectionTable::read(path)?);
        }
        if let Some(folder) = &options.road_masks {
            perception = perception.with_segmenter(RoadMaskFolder::open(folder)?);
        }
        Ok(perception)
    }

    /// With this detector of vehicles.
    #[must_use]
    pub fn with_detector(mut self, detector: impl VehicleDetector + 'static) -> Self {
        self.vehicles = Some(Box::new(detector));
        self
    }
    /// With this segmenter of the road.
    #[must_use]
    pub fn with_segmenter(mut self, segmenter: impl RoadSegmenter + 'static) -> Self {
        self.road = Some(Box::new(segmenter));
        self
    }
    /// With this detector of keypoints.
    #[must_use]
    pub fn with_keypoints(mut self, detector: impl KeypointDetector + 'static) -> Self {
        self.keypoints = Some(Box::new(detector));
        self
    }

    /// True when there is a detector of vehicles.
    pub fn detects_vehicles(&self) -> bool {
        self.vehicles.is_some()
    }
    /// True when there is a segmenter of the road; otherwise the road is found from geometry.
    pub fn segments_road(&self) -> bool {
        self.road.is_some()
    }
    /// Detectors that are there, in words.
    pub(crate) fn descriptions(&self) -> Descriptions {
        Descriptions {
            vehicles: self.vehicles.as_ref().map(|d| d.description()),
            road: self.road.as_ref().map(|d| d.description()),
            keypoints: self.keypoints.as_ref().map(|d| d.description()),
        }
    }

    /// Keeps the output of the detectors, frame by frame, as text of a recording's file; it grows as frames are observed.
    pub fn keep(&mut self) -> KeptObservations {
        let kept = KeptObservations::new(&self.descriptions());
        self.kept = Some(kept.clone());
        kept
    }

    /// Takes frames that a checkpoint knows from there, and writes all others into it.
    pub fn save_in(&mut self, checkpoint: Checkpoint) {
        self.checkpoint = Some(checkpoint);
    }

    /// True without any detector.
    pub fn is_none(&self) -> bool {
        self.vehicles.is_none() && self.road.is_none() && self.keypoints.is_none()
    }

    /// Sources in words, for the record of a run: vehicles with their keypoints, road.
    pub fn describe(&self) -> (String, String) {
        let none = || "not looked for".to_owned();
        let vehicles = self.vehicles.as_ref().map_or_else(none, |detector| detector.description());
        let vehicles = match &self.keypoints {
            Some(detector) => format!("{vehicles}; keypoints by {}", detector.description()),
            None => vehicles,
        };
        (vehicles, self.road.as_ref().map_or_else(none, |segmenter| segmenter.description()))
    }

    /// Runs the detectors on a frame, unless a checkpoint knows their output.
    ///
    /// # Errors
    /// A detector that fails; output that cannot be kept; a checkpoint of other frames.
    pub fn observe(&mut self, frame: &Frame) -> Result<Observations> {
        let earlier = self.checkpoint.as_ref().map_or(Ok(None), |checkpoint| checkpoint.earlier(frame))?;
        let observations = match earlier {
            Some(observations) => {
                if let Some(detector) = &mut self.keypoints {
                    detector.skipped(frame.timestamp_ns, &observations.detections);
                }
                observations
            }
            None => self.detect(frame)?,
        };
        if let Some(kept) = &self.kept {
            kept.add(frame.number, &observations)?;
        }
        Ok(observations)
    }

    /// Passes over frames that an earlier run observed, before the first one is observed here: detectors remember of them what they would, and
    /// their output is kept where it is to be.
    ///
    /// # Errors
    /// A checkpoint that does not know one of them, output that is to be kept without a checkpoint; nothing has changed then.
    pub fn skip(&mut self, frames: &[SkippedFrame]) -> Result<()> {
        let Self { keypoints, kept, checkpoint, .. } = self;
        let Some(checkpoint) = checkpoint else {
            return match kept {
                Some(_) => Err(Error::Detector("without a checkpoint there is no output to be kept".into())),
                None => Ok(()),
            };
        };
        checkpoint.skip(frames, |frame, line| {
            if let Some(detector) = keypoints {
                detector.skipped(frame.timestamp_ns, line.detections());
            }
            kept.iter().try_for_each(|kept| kept.add_line(line))
        })
    }

    fn detect(&mut self, frame: &Frame) -> Result<Observations> {
        let detections = match &mut self.vehicles {
            Some(detector) => detector.detect(frame)?,
            None => Vec::new(),
        };
        let road = match &mut self.road {
            Some(segmenter) => segmenter.segment(frame)?,
            None => None,
        };
        let keypoints = match &mut self.keypoints {
            Some(detector) => detector.keypoints(frame, &detections)?,
            None => Vec::new(),
        };
        let observations = Observations { detections, road, keypoints };
        if let Some(checkpoint) = &self.checkpoint {
            checkpoint.add(frame, &observations);
        }
        Ok(observations)
    }
}
