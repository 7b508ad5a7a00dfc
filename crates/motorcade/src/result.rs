//! The result of a drive.

use motorcade_geometry::PinholeCamera;
use motorcade_multibody::MultibodyGraph;
use motorcade_odometry::{EgoFrame, EgoTrajectory, FrameStatus, RoadMeasurement};
use motorcade_perception::Detection;
use motorcade_vehicles::VehicleTrajectory;

use crate::finite;
use crate::plausibility;
use crate::progress::Progress;
use crate::record::{FrameInfo, FrontEndRecord};
use crate::timing::Stopwatch;

/// The result of a drive.
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
    /// Report of its solution.
    pub graph_report: Option<motorcade_graph::Report>,
    /// Detections handed in by perception, frame by frame.
    pub detections: Vec<Vec<Detection>>,
    /// False when there was no source of vehicles.
    pub detects_vehicles: bool,
    /// Times.
    pub stopwatch: Stopwatch,
    /// Messages for the user.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
    /// Number of frames of the input, where the caller said so.
    pub planned_frames: Option<usize>,
}

/// Estimates of a window, to be put together with what the front end knows.
pub(crate) struct Estimated {
    pub(crate) camera: PinholeCamera,
    pub(crate) ego: EgoTrajectory,
    pub(crate) vehicles: Vec<VehicleTrajectory>,
    pub(crate) graph: Option<(MultibodyGraph, motorcade_graph::Report)>,
    /// Warnings of the estimator.
    pub(crate) warnings: Vec<String>,
    /// True when the camera's motion came in metres.
    pub(crate) metric: bool,
}

impl RunResult {
    /// Puts the output of the front end and of the estimator together; reports the warnings.
    pub(crate) fn new(record: FrontEndRecord, estimated: Estimated, progress: &dyn Progress) -> Self {
        let Estimated { camera, ego, vehicles, graph, warnings, metric } = estimated;
        let (graph, graph_report) = graph.unzip();
        let mut result = Self {
            camera,
            frames: record.frames,
            ego,
            road_measurements: record.road_measurements,
            vehicles,
            graph,
            graph_report,
            detections: record.detections,
            detects_vehicles: record.detects_vehicles,
            stopwatch: record.stopwatch,
            warnings: record.warnings,
            interrupted: record.interrupted,
            planned_frames: record.planned_frames,
        };
        let repaired = finite::keep_finite(&mut result);
        let speeds = plausibility::of_speeds(&result);
        let summary = summary_warnings(&result, metric);
        for warning in warnings.into_iter().chain(repaired).chain(speeds).chain(summary) {
            progress.warn(&warning);
            result.warnings.push(warning);
        }
        result
    }

    /// Share of frames whose pose was tracked (or stood). Frames of the first second that were filled in from the map that
    /// began after them do not count against it.
    pub fn tracked_share(&self) -> f64 {
        const FIRST_SECOND_NS: i64 = 1_000_000_000;
        let start_ns = self.frames.first().map_or(0, |f| f.timestamp_ns);
        let in_first_second =
            |k: usize| self.frames.get(k).is_some_and(|f| f.timestamp_ns - start_ns < FIRST_SECOND_NS);
        let good = |s: FrameStatus| matches!(s, FrameStatus::Tracked | FrameStatus::Standstill);
        let counted =
            |(k, f): &(usize, &EgoFrame)| !in_first_second(*k) || f.status != FrameStatus::Initialising;
        let (mut tracked, mut all) = (0_usize, 0_usize);
        for (_, frame) in self.ego.frames.iter().enumerate().filter(counted) {
            all += 1;
            tracked += usize::from(good(frame.status));
        }
        // A run that never got a map has tracked nothing.
        if tracked == 0 { 0.0 } else { tracked as f64 / all as f64 }
    }
}

/// Warnings about a result as a whole; `metric` when the camera's motion came in metres.
fn summary_warnings(result: &RunResult, metric: bool) -> Vec<String> {
    let mut out = Vec::new();
    let n = result.ego.frames.len();
    if let (true, Some(first), Some(last)) = (result.interrupted, result.frames.first(), result.frames.last())
    {
        let all = result.planned_frames.map_or_else(String::new, |all| format!(" of {all}"));
        out.push(format!("interrupted: the results hold frames {} to {}{all}", first.number, last.number));
    }
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
    if !result.detects_vehicles {
        out.push("no vehicles were looked for: give --models or --detections".to_owned());
    }
    out
}
