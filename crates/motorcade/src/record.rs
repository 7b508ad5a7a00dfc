//! Output of the front end over a drive; the stages after it see nothing else.

use motorcade_dataset::Frame;
use motorcade_geometry::BoundingBox;
use motorcade_odometry::{OdometryTrajectory, RoadMeasurement, Rows};
use motorcade_perception::{Detection, Observations, VehicleKeypoints};
use motorcade_places::PlaceKeyframe;

use crate::focal_by_turns::FocalByTurns;
use crate::repeated_frames::Repetition;
use crate::settings::Settings;
use crate::timing::Stopwatch;

/// Frames that room is made for at most: a day at 10 frames/s.
const MOST_RESERVED: usize = 1 << 20;

/// A frame of the input as the run saw it.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct FrameInfo {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// Reason why it could not be read, when it could not.
    pub problem: Option<String>,
}

impl FrameInfo {
    /// True of a frame that repeats the one before and has nothing of its own to be tracked.
    pub fn is_repeated(&self) -> bool {
        self.problem.as_deref() == Some(Repetition::Repeated.problem())
    }

    pub(crate) fn of(frame: &Frame) -> Self {
        Self { number: frame.number, timestamp_ns: frame.timestamp_ns, problem: None }
    }
}

/// Mean interval of frames \[s\]; a tenth of a second where there are not two, or their times do not grow.
pub(crate) fn mean_interval_s(frames: &[FrameInfo]) -> f64 {
    let ends = frames.first().zip(frames.last());
    mean_interval_between(ends.map(|(first, last)| [first.timestamp_ns, last.timestamp_ns]), frames.len())
}

/// The same by the times of the first and the last of some frames \[ns\].
pub(crate) fn mean_interval_between(ends: Option<[i64; 2]>, frames: usize) -> f64 {
    let duration_ns = ends.map(|[first_ns, last_ns]| last_ns - first_ns).filter(|ns| *ns > 0);
    duration_ns.map_or(0.1, |ns| ns as f64 * 1e-9 / (frames - 1) as f64)
}

/// Output of the front end over a drive. `frames`, `detections` and `keypoints` have one entry a frame.
#[derive(Clone, Debug)]
pub struct FrontEndRecord {
    /// Frames, in order.
    pub frames: Vec<FrameInfo>,
    /// Detections of each frame.
    pub detections: Rows<Vec<Detection>>,
    /// Keypoints of vehicles in each frame.
    pub keypoints: Rows<Vec<VehicleKeypoints>>,
    /// False when there was no source of vehicles.
    pub detects_vehicles: bool,
    /// The camera's motion up to scale.
    pub motion: OdometryTrajectory,
    /// Measurements of the road.
    pub road_measurements: Vec<RoadMeasurement>,
    /// Measurements of the road that an online run no longer holds.
    pub forgotten_measurements: usize,
    /// True once the motion of the oldest rows is forgotten: the drive can no longer be estimated as a whole.
    pub forgotten: bool,
    /// Keyframes of places; none of external trajectories.
    pub places: Vec<PlaceKeyframe>,
    /// Times.
    pub stopwatch: Stopwatch,
    /// Rectangles around what is fixed to the camera \[px\].
    pub fixed_regions: Vec<BoundingBox>,
    /// Focal length that the turns say; `None` where the camera turned too little, or was calibrated from the drive.
    pub focal_by_turns: Option<FocalByTurns>,
    /// Messages for the user.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
    /// True when a fault of the program ended it before the last frame.
    pub failed: bool,
    /// Number of frames of the input, where the caller said so.
    pub planned_frames: Option<usize>,
}

impl FrontEndRecord {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            frames: Vec::new(),
            detections: Rows::default(),
            keypoints: Rows::default(),
            detects_vehicles: settings.external.vehicles.is_some(),
            motion: OdometryTrajectory::default(),
            road_measurements: Vec::new(),
            forgotten_measurements: 0,
            forgotten: false,
            places: Vec::new(),
            stopwatch: Stopwatch::default(),
            fixed_regions: Vec::new(),
            focal_by_turns: None,
            warnings: Vec::new(),
            interrupted: false,
            failed: false,
            planned_frames: None,
        }
    }

    /// Marks a drive whose estimate was stopped after the last frame.
    pub(crate) fn end_early(&mut self) {
        self.interrupted = true;
        self.planned_frames.get_or_insert(self.frames.len());
    }

    /// Makes room for so many frames, as far as there is memory: a list that grows by doubling leaves holes of its size.
    pub(crate) fn reserve(&mut self, frames: usize) {
        let more = frames.min(MOST_RESERVED).saturating_sub(self.frames.len());
        // A list without that room grows as it always does.
        let _ = self.frames.try_reserve_exact(more);
    }

    pub(crate) fn push(&mut self, info: FrameInfo, observations: Observations) {
        self.frames.push(info);
        self.detections.push(observations.detections);
        self.keypoints.push(observations.keypoints);
    }

    /// Times of all frames \[ns\].
    pub fn timestamps_ns(&self) -> Vec<i64> {
        self.frames.iter().map(|f| f.timestamp_ns).collect()
    }

    /// Everything known after the first `rows` frames, by the final motion.
    pub fn view(&self, rows: usize) -> FrontEndView<'_> {
        let known = self.road_measurements.partition_point(|m| m.frame < rows);
        FrontEndView {
            frames: &self.frames[..rows],
            detections: &self.detections,
            keypoints: &self.keypoints,
            motion: &self.motion,
            road_measurements: &self.road_measurements[..known],
            places: known_places(&self.places, rows),
        }
    }
}

/// The keyframes of places among the first `rows` frames.
pub(crate) fn known_places(places: &[PlaceKeyframe], rows: usize) -> &[PlaceKeyframe] {
    &places[..places.partition_point(|k| k.frame < rows)]
}

/// Everything the front end knows after some frame.
#[derive(Clone, Copy)]
pub struct FrontEndView<'a> {
    /// Frames.
    pub frames: &'a [FrameInfo],
    /// Detections of each frame; may hold later frames too.
    pub detections: &'a Rows<Vec<Detection>>,
    /// Keypoints of each frame; may hold later frames too.
    pub keypoints: &'a Rows<Vec<VehicleKeypoints>>,
    /// The camera's motion up to scale; may hold later frames too.
    pub motion: &'a OdometryTrajectory,
    /// Measurements of the road, in order of frames.
    pub road_measurements: &'a [RoadMeasurement],
    /// Keyframes of places, in order of frames.
    pub places: &'a [PlaceKeyframe],
}
