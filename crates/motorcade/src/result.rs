//! The result of a drive.

use motorcade_geometry::{BoundingBox, PinholeCamera};
use motorcade_multibody::MultibodyGraph;
use motorcade_odometry::{EgoFrame, EgoTrajectory, FrameStatus, RoadMeasurement};
use motorcade_perception::Detection;
use motorcade_vehicles::VehicleTrajectory;

use crate::closed_loop::Loops;
use crate::focal_by_turns::FocalByTurns;
use crate::record::FrameInfo;
use crate::timing::Stopwatch;

/// The result of a drive.
pub struct RunResult {
    /// Intrinsics of the (undistorted) frames.
    pub camera: PinholeCamera,
    /// Frames, in order.
    pub frames: Vec<FrameInfo>,
    /// The camera's trajectory and the road.
    pub ego: EgoTrajectory,
    /// Speed of the camera over the interval before each frame \[m/s\], as an online run reported it: poses are reported at the scale of their time, so
    /// that the difference of two is no speed where the scale changed. `None` of a drive that was estimated as a whole.
    pub speeds_mps: Option<Vec<f64>>,
    /// Road measurements the scale came from; of an online run the last ones.
    pub road_measurements: Vec<RoadMeasurement>,
    /// Number of road measurements of the whole drive.
    pub road_measurement_count: usize,
    /// Vehicles.
    pub vehicles: Vec<VehicleTrajectory>,
    /// The multi-object graph, solved.
    pub graph: Option<MultibodyGraph>,
    /// Report of its solution.
    pub graph_report: Option<motorcade_graph::Report>,
    /// Places seen again.
    pub loops: Loops,
    /// Detections handed in by perception, frame by frame.
    pub detections: Vec<Vec<Detection>>,
    /// False when there was no source of vehicles.
    pub detects_vehicles: bool,
    /// Times.
    pub stopwatch: Stopwatch,
    /// Rectangles around what is fixed to the camera \[px\]: a bonnet, reflections on the windscreen.
    pub fixed_regions: Vec<BoundingBox>,
    /// Focal length that the turns of the drive say; `None` where the camera turned too little, or was calibrated from the drive.
    pub focal_by_turns: Option<FocalByTurns>,
    /// Messages for the user.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
    /// True when a fault of the program ended it before the last frame: `interrupted` too, and a warning says which.
    pub failed: bool,
    /// Number of frames of the input, where the caller said so.
    pub planned_frames: Option<usize>,
}

impl RunResult {
    /// Way of the camera from the frame before to this one \[m\]; 0 in the first. Both ends are at one scale.
    pub fn way_m(&self, frame: usize) -> f64 {
        let Some(before) = frame.checked_sub(1) else { return 0.0 };
        if let Some(speed_mps) = self.speeds_mps.as_ref().and_then(|speeds| speeds.get(frame)) {
            return speed_mps
                * (self.frames[frame].timestamp_ns - self.frames[before].timestamp_ns) as f64
                * 1e-9;
        }
        let place = |k: usize| self.ego.frames[k].world_from_camera.translation();
        (place(frame) - place(before)).norm()
    }

    /// Share of frames whose pose was tracked (or stood). Frames of the first second that were filled in from the map that
    /// began after them do not count against it, nor do frames that repeat the one before.
    pub fn tracked_share(&self) -> f64 {
        const FIRST_SECOND_NS: i64 = 1_000_000_000;
        let start_ns = self.frames.first().map_or(0, |f| f.timestamp_ns);
        let in_first_second =
            |k: usize| self.frames.get(k).is_some_and(|f| f.timestamp_ns - start_ns < FIRST_SECOND_NS);
        let good = |s: FrameStatus| matches!(s, FrameStatus::Tracked | FrameStatus::Standstill);
        let repeated = |k: usize| self.frames.get(k).is_some_and(FrameInfo::is_repeated);
        let counted = |(k, f): &(usize, &EgoFrame)| {
            !repeated(*k) && (!in_first_second(*k) || f.status != FrameStatus::Initialising)
        };
        let (mut tracked, mut all) = (0_usize, 0_usize);
        for (_, frame) in self.ego.frames.iter().enumerate().filter(counted) {
            all += 1;
            tracked += usize::from(good(frame.status));
        }
        // A run that never got a map has tracked nothing.
        if tracked == 0 { 0.0 } else { tracked as f64 / all as f64 }
    }
}
