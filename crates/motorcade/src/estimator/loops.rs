//! Loops of a drive: places seen again, and the trajectory corrected by them.

use motorcade_multibody::{LoopEdge, close_loops};
use motorcade_odometry::EgoTrajectory;
use motorcade_places::{FramePlacement, PlaceMap, PlaceMatch, PlacedKeyframe, find_places, place_keyframes};

use crate::closed_loop::{ClosedLoop, Loops};
use crate::record::FrontEndRecord;
use crate::settings::Settings;

/// Finds the loops of a drive and corrects the trajectory by them. A drive without any stays as it is, to the last bit.
pub(super) fn close(record: &FrontEndRecord, ego: &mut EgoTrajectory, settings: &Settings) -> Loops {
    let config = &settings.config;
    let mut loops = Loops { keyframes: record.places.len(), ..Loops::default() };
    if record.places.is_empty() {
        return loops;
    }
    let way_m = ways_m(ego);
    let placement = |frame: usize| FramePlacement {
        world_from_camera: ego.frames[frame].world_from_camera,
        way_m: way_m[frame],
    };
    let mut placed = place_keyframes(&settings.camera, &record.places, placement, &config.places);
    let may_join = |found: &PlaceMatch| within_drift(found, &placed, settings);
    let (found, report) = find_places(&settings.camera, &placed, may_join, &config.places);
    (loops.candidates, loops.verified) = (report.candidates, report.verified);
    let edges: Vec<LoopEdge> = found.iter().map(|m| edge(m, &placed)).collect();
    match close_loops(ego, &edges, &config.loops, &config.graph, settings.threads) {
        Ok(corrected) => {
            loops.most_moved_m = corrected.most_moved_m;
            loops.odometry_factor = corrected.odometry_factor;
            let closed = found.iter().zip(edges).zip(corrected.weights.iter().zip(&corrected.closed));
            loops.all = closed
                .map(|((found, edge), (weight, closed))| ClosedLoop {
                    edge,
                    inliers: found.inliers,
                    share: found.share,
                    rms_px: found.rms_px,
                    weight: *weight,
                    closed: *closed,
                })
                .collect();
        }
        Err(error) => loops.problem = Some(error.to_string()),
    }
    correct(&mut placed, ego);
    join(&mut placed, &loops);
    loops.map = Some(PlaceMap { camera: settings.camera, height_m: settings.height_m, keyframes: placed });
    loops
}

/// Puts the keyframes where the corrected trajectory has them.
fn correct(placed: &mut [PlacedKeyframe], ego: &EgoTrajectory) {
    let way_m = ways_m(ego);
    for keyframe in placed {
        keyframe.world_from_camera = ego.frames[keyframe.frame].world_from_camera;
        keyframe.way_m = way_m[keyframe.frame];
    }
}

/// Maps that a loop joined are one.
fn join(placed: &mut [PlacedKeyframe], loops: &Loops) {
    for l in loops.closed() {
        let segment_of = |placed: &[PlacedKeyframe], frame: usize| {
            placed.iter().find(|k| k.frame == frame).map(|k| k.segment)
        };
        if let (Some(earlier), Some(later)) =
            (segment_of(placed, l.edge.earlier), segment_of(placed, l.edge.later))
        {
            placed.iter_mut().filter(|k| k.segment == later).for_each(|k| k.segment = earlier);
        }
    }
}

fn edge(found: &PlaceMatch, placed: &[PlacedKeyframe]) -> LoopEdge {
    LoopEdge {
        earlier: placed[found.candidate].frame,
        later: placed[found.query].frame,
        later_from_earlier: found.query_from_candidate,
        covariance: found.covariance,
    }
}

/// Way driven to each frame \[m\].
fn ways_m(ego: &EgoTrajectory) -> Vec<f64> {
    let mut way_m = 0.0;
    let mut before = ego.frames.first().map(|f| f.world_from_camera);
    let next = |frame: &motorcade_odometry::EgoFrame| {
        way_m += before.map_or(0.0, |b| (frame.world_from_camera.translation() - b.translation()).norm());
        before = Some(frame.world_from_camera);
        way_m
    };
    ego.frames.iter().map(next).collect()
}

/// False where odometry excludes that the two frames see the same place. Between maps it does not know.
fn within_drift(found: &PlaceMatch, placed: &[PlacedKeyframe], settings: &Settings) -> bool {
    let (later, earlier) = (&placed[found.query], &placed[found.candidate]);
    if later.segment != earlier.segment {
        return true;
    }
    let expected = later.world_from_camera.inverse() * earlier.world_from_camera;
    let apart = (expected.inverse() * found.query_from_candidate).translation().norm();
    let options = &settings.config.loops;
    apart <= options.gate_m + options.gate_share * (later.way_m - earlier.way_m)
}
