//! Assembly of a result from the front end and the estimator, with its warnings.

use motorcade_geometry::PinholeCamera;
use motorcade_multibody::MultibodyGraph;
use motorcade_odometry::{EgoFrame, EgoTrajectory, FrameStatus};
use motorcade_vehicles::VehicleTrajectory;

use crate::check_options::CheckOptions;
use crate::clock_jumps;
use crate::closed_loop::Loops;
use crate::detection_faults;
use crate::finite;
use crate::plausibility;
use crate::progress::Progress;
use crate::record::FrontEndRecord;
use crate::result::RunResult;
use crate::swapped_frames;

/// Estimates of a window, to be put together with what the front end knows.
pub(crate) struct Estimated {
    pub(crate) camera: PinholeCamera,
    pub(crate) ego: EgoTrajectory,
    pub(crate) vehicles: Vec<VehicleTrajectory>,
    pub(crate) loops: Loops,
    pub(crate) graph: Option<(MultibodyGraph, motorcade_graph::Report)>,
    /// Warnings of the estimator.
    pub(crate) warnings: Vec<String>,
    /// True when the camera's motion came in metres.
    pub(crate) metric: bool,
    /// Speeds of an online run, a frame each.
    pub(crate) speeds_mps: Option<Vec<f64>>,
}

impl RunResult {
    /// Puts the output of the front end and of the estimator together; reports the warnings.
    pub(crate) fn new(
        record: FrontEndRecord,
        estimated: Estimated,
        checks: &CheckOptions,
        progress: &dyn Progress,
    ) -> Self {
        let Estimated { camera, ego, vehicles, graph, loops, warnings, metric, speeds_mps } = estimated;
        let (graph, graph_report) = graph.unzip();
        let mut result = Self {
            camera,
            frames: record.frames,
            ego,
            speeds_mps,
            road_measurement_count: record.road_measurements.len() + record.forgotten_measurements,
            road_measurements: record.road_measurements,
            vehicles,
            graph,
            graph_report,
            loops,
            detections: record.detections.into_kept(),
            detects_vehicles: record.detects_vehicles,
            stopwatch: record.stopwatch,
            fixed_regions: record.fixed_regions,
            focal_by_turns: record.focal_by_turns,
            warnings: record.warnings,
            interrupted: record.interrupted,
            failed: record.failed,
            planned_frames: record.planned_frames,
        };
        let repaired = finite::keep_finite(&mut result);
        let speeds = plausibility::of_speeds(&result, &checks.advanced.plausibility);
        let summary = summary_warnings(&result, metric);
        let swapped = swapped_frames::of(&result.frames, &result.ego.frames, &checks.advanced.swapped_frames);
        let jumps = clock_jumps::of(&result.frames, &result.ego.frames, &checks.advanced.clock);
        let boxes = detection_faults::of(
            &result.frames,
            &result.detections,
            result.camera.height,
            &checks.advanced.detections,
        );
        let found =
            warnings.into_iter().chain(repaired).chain(swapped).chain(jumps).chain(boxes).chain(speeds);
        for warning in found.chain(summary) {
            progress.warn(&warning);
            result.warnings.push(warning);
        }
        result
    }
}

/// Warnings about a result as a whole; `metric` when the camera's motion came in metres.
fn summary_warnings(result: &RunResult, metric: bool) -> Vec<String> {
    let mut out = Vec::new();
    let n = result.ego.frames.len();
    if let (true, Some(first), Some(last)) = (result.interrupted, result.frames.first(), result.frames.last())
    {
        let all = result.planned_frames.map_or_else(String::new, |all| format!(" of {all}"));
        let (first, last) = (first.number, last.number);
        out.push(format!("interrupted: the results hold {n}{all} frames, numbers {first} to {last}"));
    }
    let tracked = |f: &&EgoFrame| matches!(f.status, FrameStatus::Tracked | FrameStatus::Standstill);
    let repeated = result.frames.iter().filter(|f| f.is_repeated()).count();
    let untracked = n - result.ego.frames.iter().filter(tracked).count();
    // A warning of its own tells of those that repeat the frame before.
    if untracked > repeated {
        out.push(format!(
            "{} of {n} frames have a bridged or filled-in pose (see `status` in frames.csv)",
            untracked - repeated
        ));
    }
    if result.road_measurements.is_empty() && n > 0 && !metric {
        out.push(
            "the road was never seen: the metric scale is a guess, lengths may be off by a factor of two"
                .to_owned(),
        );
    }
    if !result.detects_vehicles {
        out.push("no vehicles were looked for: run without --models none, or give --detections".to_owned());
    }
    out
}
