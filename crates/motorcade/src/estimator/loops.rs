//! Places seen again in a drive, those of a kept map too, and the trajectory corrected by them.

use motorcade_graph::Stop;
use motorcade_multibody::{LoopSolve, close_loops};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_places::{
    FoundPlaces, FramePlacement, PlaceKeyframe, PlaceMap, PlaceMatch, PlaceSearch, PlacedKeyframe,
    place_keyframes,
};

use super::place_edges::Matched;
use crate::closed_loop::Loops;
use crate::kept_map::MapUse;
use crate::record::{FrontEndRecord, mean_interval_s};
use crate::settings::Settings;

/// Number of the first of the maps in a kept map: a drive has none of these.
const SEGMENTS_OF_MAP: usize = usize::MAX / 2;

/// Finds the places of a drive that were seen before and corrects the trajectory by them. A drive without any stays as it is, to the last
/// bit.
pub(super) fn close(
    record: &mut FrontEndRecord,
    ego: &mut EgoTrajectory,
    settings: &Settings,
    stop: &(dyn Fn() -> bool + Sync),
) -> Loops {
    let config = &settings.config;
    let mut loops = Loops { keyframes: record.places.len(), ..Loops::default() };
    let kept = settings.external.map.as_ref();
    loops.kept = kept.map(MapUse::of);
    if record.places.is_empty() {
        return loops;
    }
    // The features are not held twice.
    let Some(found) = search(std::mem::take(&mut record.places), ego, settings, stop) else { return loops };
    (loops.candidates, loops.verified) = (found.report.candidates, found.report.verified);
    let of_map = kept.map_or(0, |kept| kept.map.keyframes.len());
    let matched = Matched { keyframes: &found.keyframes, of_map, matches: &found.matches };
    let camera = |keyframe: usize| (keyframe >= of_map).then(|| found.keyframes[keyframe].frame);
    let known =
        |keyframe: usize| (found.keyframes[keyframe].world_from_camera, found.keyframes[keyframe].covariance);
    let edges = matched.edges(camera, known);
    let solve = LoopSolve {
        graph: &config.graph,
        interval_s: mean_interval_s(&record.frames),
        threads: settings.threads,
        stop: Stop::new(stop),
    };
    match close_loops(ego, &edges, &config.loops, &solve) {
        Ok(report) => {
            (loops.most_moved_m, loops.odometry_factor) = (report.most_moved_m, report.odometry_factor);
            matched.put_down(&mut loops, &matched.verdicts(camera, &report));
        }
        Err(error) => loops.problem = Some(error.to_string()),
    }
    let mut keyframes = found.keyframes;
    let mut own = keyframes.split_off(of_map);
    correct(&mut own, ego);
    join(&mut own, &loops);
    loops.map = Some(PlaceMap { camera: settings.camera, height_m: settings.height_m, keyframes: own });
    loops
}

/// Looks for the keyframes of a drive among earlier ones of it and those of the kept map, which come first in the answer.
/// `None` when it is asked to stop.
fn search(
    taken: Vec<PlaceKeyframe>,
    ego: &EgoTrajectory,
    settings: &Settings,
    stop: &dyn Fn() -> bool,
) -> Option<FoundPlaces> {
    let options = &settings.config.places;
    let way_m = ways_m(ego);
    let placement = |frame: usize| FramePlacement {
        world_from_camera: ego.frames[frame].world_from_camera,
        covariance: ego.frames[frame].covariance,
        way_m: way_m[frame],
    };
    let placed = place_keyframes(&settings.camera, taken, placement, options);
    let mut search = search_with_map(settings);
    for keyframe in placed {
        if stop() {
            return None;
        }
        search.take(keyframe, |later, earlier, found| within_drift(found, (later, earlier), settings));
    }
    Some(search.finish())
}

/// A search that holds the keyframes of the kept map, where there is one.
pub(super) fn search_with_map(settings: &Settings) -> PlaceSearch {
    let mut search = PlaceSearch::new(settings.camera, settings.config.places);
    for keyframe in settings.external.map.iter().flat_map(|kept| &kept.map.keyframes) {
        search.add(PlacedKeyframe { segment: SEGMENTS_OF_MAP + keyframe.segment, ..keyframe.clone() });
    }
    search
}

/// Puts the keyframes where the corrected trajectory has them.
fn correct(placed: &mut [PlacedKeyframe], ego: &EgoTrajectory) {
    let way_m = ways_m(ego);
    for keyframe in placed {
        let EgoFrame { world_from_camera, covariance, .. } = &ego.frames[keyframe.frame];
        (keyframe.world_from_camera, keyframe.covariance) = (*world_from_camera, *covariance);
        keyframe.way_m = way_m[keyframe.frame];
    }
}

/// Maps that a loop joined are one.
pub(super) fn join(placed: &mut [PlacedKeyframe], loops: &Loops) {
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

/// Way driven to each frame \[m\].
fn ways_m(ego: &EgoTrajectory) -> Vec<f64> {
    let mut way_m = 0.0;
    let mut before = ego.frames.first().map(|f| f.world_from_camera);
    let next = |frame: &EgoFrame| {
        way_m += before.map_or(0.0, |b| (frame.world_from_camera.translation() - b.translation()).norm());
        before = Some(frame.world_from_camera);
        way_m
    };
    ego.frames.iter().map(next).collect()
}

/// False where odometry excludes that the two frames see the same place. Between maps it does not know.
pub(super) fn within_drift(
    found: &PlaceMatch,
    (later, earlier): (&PlacedKeyframe, &PlacedKeyframe),
    settings: &Settings,
) -> bool {
    if later.segment != earlier.segment {
        return true;
    }
    let expected = later.world_from_camera.inverse() * earlier.world_from_camera;
    let apart = (expected.inverse() * found.query_from_candidate).translation().norm();
    let options = &settings.config.loops;
    apart <= options.advanced.gate_m + options.advanced.gate_share * (later.way_m - earlier.way_m)
}
