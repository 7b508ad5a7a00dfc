//! `run.json`: what was run, on what, with which settings, and how it went.

use serde_json::json;

use super::camera::status_name;
use super::{ListedFile, RunContext};
use crate::result::RunResult;

/// The record of a run whose other files are `files`.
pub(super) fn record(result: &RunResult, context: &RunContext, files: &[ListedFile]) -> serde_json::Value {
    let mut statuses = std::collections::BTreeMap::<&str, usize>::new();
    for frame in &result.ego.frames {
        *statuses.entry(status_name(frame.status)).or_default() += 1;
    }
    let problem =
        |f: &crate::record::FrameInfo| f.problem.as_ref().map(|p| json!({"frame": f.number, "problem": p}));
    let problems: Vec<_> = result.frames.iter().filter_map(problem).collect();
    let mut record = json!({
        "motorcade": env!("CARGO_PKG_VERSION"),
        "command": context.command,
        "fingerprint": context.fingerprint,
        "configuration": context.config,
        "input": context.input,
        "camera_height_m": result.ego.height_m,
        "world": world(result),
        "perception": {"vehicles": context.perception.0, "road": context.perception.1},
        "interrupted": result.interrupted,
        "counters": {
            "frames": result.frames.len(),
            "frames_by_status": statuses,
            "road_measurements": result.road_measurement_count,
            "detections": result.detections.iter().map(Vec::len).sum::<usize>(),
            "vehicles": result.vehicles.len(),
            "vehicles_moving": result.vehicles.iter().filter(|v| v.p_moving > 0.5).count(),
        },
        "length_m": result.ego.length_m(),
        "fixed_regions_px": result.fixed_regions.iter().map(|b| [b.x1, b.y1, b.x2, b.y2]).collect::<Vec<_>>(),
        "focal_length_by_turns": result.focal_by_turns,
        "variance_factors": result.graph.as_ref().map(|g| g.variance_factors()),
        "vehicles_looked_for": result.detects_vehicles,
        "unreadable_frames": problems,
        "timings": result.stopwatch.summary(),
        "warnings": result.warnings,
        "files": files,
    });
    if !result.loops.all.is_empty() {
        let loops = &result.loops;
        record["loops"] = json!({
            "closed": loops.closed().count(),
            "switched_off": loops.all.len() - loops.closed().count(),
            "place_keyframes": loops.keyframes,
            "candidates": loops.candidates,
            "verified": loops.verified,
            "odometry_factor": loops.odometry_factor,
            "most_moved_m": loops.most_moved_m,
            "vehicles_met_again": loops.vehicles_met_again,
        });
    }
    if let Some(kept) = &result.loops.kept {
        let number = |row: usize| result.frames.get(row).map_or(row as u64, |f| f.number);
        record["map"] = json!({
            "digest": kept.digest,
            "keyframes": kept.keyframes,
            "matches": kept.held().count(),
            "switched_off": kept.matches.len() - kept.held().count(),
            "first_frame": kept.held().next().map(|m| number(m.edge.frame)),
        });
        if let Some(row) = kept.first_estimated_frame {
            record["map"]["first_estimated_frame"] = json!(number(row));
        }
    }
    record
}

/// The world of all poses in words.
fn world(result: &RunResult) -> &'static str {
    if result.loops.kept.as_ref().is_some_and(|kept| kept.first_estimated_frame.is_some()) {
        "camera frame of the first processed frame, from frame map.first_estimated_frame on the world of the map given by --map: x right, y down, z forward, metres"
    } else if result.loops.in_world_of_map() {
        "world of the map given by --map, the camera frame of its own first frame: x right, y down, z forward, metres"
    } else {
        "camera frame of the first processed frame: x right, y down, z forward, metres"
    }
}
