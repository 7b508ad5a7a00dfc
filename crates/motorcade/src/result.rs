//! What a run found.

use motorcade_geometry::PinholeCamera;
use motorcade_multibody::MultibodyGraph;
use motorcade_odometry::{EgoFrame, EgoTrajectory, FrameStatus, RoadMeasurement};
use motorcade_perception::Detection;
use motorcade_vehicles::VehicleTrajectory;

use crate::timing::Stopwatch;

/// A frame of the input as the run saw it.
#[derive(Clone, Debug)]
pub struct FrameInfo {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// Why it could not be read, when it could not.
    pub problem: Option<String>,
}

/// What a run found.
pub struct RunResult {
    /// Intrinsics of the (undistorted) frames.
    pub camera: PinholeCamera,
    /// Frames, in order.
    pub frames: Vec<FrameInfo>,
    /// The camera's trajectory and the road.
    pub ego: EgoTrajectory,
    /// Road measurements the scale came from.
    pub road_measurements: Vec<RoadMeasurement>,
    /// Vehicles.
    pub vehicles: Vec<VehicleTrajectory>,
    /// The multi-object graph, solved.
    pub graph: Option<MultibodyGraph>,
    /// How its solution went.
    pub graph_report: Option<motorcade_graph::Report>,
    /// Detections handed in by perception, frame by frame.
    pub detections: Vec<Vec<Detection>>,
    /// False when nobody looked for vehicles.
    pub looked_for_vehicles: bool,
    /// Times.
    pub stopwatch: Stopwatch,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
}

impl RunResult {
    /// Share of frames whose pose was tracked (or stood). Frames of the first second that were filled in from the map that
    /// began after them do not count against it.
    pub fn tracked_share(&self) -> f64 {
        const FIRST_SECOND: usize = 10;
        let good = |s: FrameStatus| matches!(s, FrameStatus::Tracked | FrameStatus::Standstill);
        let counted =
            |(k, f): &(usize, &EgoFrame)| *k >= FIRST_SECOND || f.status != FrameStatus::Initialising;
        let (mut tracked, mut all) = (0_usize, 0_usize);
        for (_, frame) in self.ego.frames.iter().enumerate().filter(counted) {
            all += 1;
            tracked += usize::from(good(frame.status));
        }
        // A run that never got a map has tracked nothing.
        if tracked == 0 { 0.0 } else { tracked as f64 / all as f64 }
    }
}

/// What the user should know of a result; `metric` when the camera's motion came in metres.
pub(crate) fn summary_warnings(result: &RunResult, metric: bool) -> Vec<String> {
    let mut out = Vec::new();
    let n = result.ego.frames.len();
    let tracked = |f: &&EgoFrame| matches!(f.status, FrameStatus::Tracked | FrameStatus::Standstill);
    let untracked = n - result.ego.frames.iter().filter(tracked).count();
    if untracked > 0 {
        out.push(format!(
            "{untracked} of {n} frames have a bridged or filled-in pose (see `status` in frames.csv)"
        ));
    }
    if result.road_measurements.is_empty() && n > 0 && !metric {
        out.push(
            "the road was never seen: the metric scale is a guess, lengths may be off by a factor of two"
                .to_owned(),
        );
    }
    if !result.looked_for_vehicles {
        out.push("no vehicles were looked for: give --models or --detections".to_owned());
    }
    out
}
