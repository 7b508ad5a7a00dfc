//! Two kept maps that share places made one.

use motorcade_dataset::HEIGHT_RANGE_M;
use motorcade_geometry::{Camera, Pose, World};
use motorcade_multibody::{MapEdge, PlaceEdges, close_loops};
use motorcade_odometry::{EgoTrajectory, OdometryTrajectory};
use motorcade_places::{FoundPlaces, PlaceMap, PlaceSearch, PlacedKeyframe};
use nalgebra::Matrix6;

use crate::config::Config;
use crate::error::{Error, Result};

/// Time between keyframes that the uncertainty of their steps is told for \[ns\]: 3.3 m at 10 m/s.
const STEP_NS: i64 = 330_000_000;
/// Height of a camera whose map tells none that a camera has \[m\].
const USUAL_HEIGHT_M: f64 = 1.65;

/// Two maps as one.
#[derive(Clone, Debug)]
pub struct MergedMap {
    /// The map, in the world of the first one.
    pub map: PlaceMap,
    /// Keyframes of the second map that see places of the first one.
    pub matches: usize,
    /// Farthest that a keyframe of the second map was moved beside the move of all \[m\].
    pub most_bent_m: f64,
}

/// Joins two maps that share places, in the world of the first. The keyframes of the second one move: as one body to where its matches
/// with the first put it, and against each other as far as the uncertainty of the way between them allows.
///
/// # Errors
/// Maps that do not meet.
pub fn merge_maps(first: &PlaceMap, second: &PlaceMap, config: &Config) -> Result<MergedMap> {
    let apart = |why: &str| Error::Input(format!("the two maps are not joined: {why}"));
    let own = first.keyframes.len();
    let free = first.keyframes.iter().map(|k| k.segment + 1).max().unwrap_or(0);
    let FoundPlaces { mut keyframes, matches, .. } = search(first, second, free, config);
    let edge = |m: &motorcade_places::PlaceMatch| MapEdge {
        frame: m.query - own,
        world_from_keyframe: keyframes[m.candidate].world_from_camera,
        camera_from_keyframe: m.query_from_candidate,
        covariance: m.covariance,
    };
    let edges = PlaceEdges { loops: Vec::new(), map: matches.iter().map(edge).collect() };
    if edges.is_empty() {
        return Err(apart("no place of the second one is seen in the first"));
    }
    let mut ego = way(&keyframes[own..], second.height_m, config);
    let before: Vec<Pose<World, Camera>> = ego.frames.iter().map(|f| f.world_from_camera).collect();
    let report = close_loops(&mut ego, &edges, &config.loops, &config.graph, 1)
        .map_err(|e| apart(&format!("their graph was not solved ({e})")))?;
    let held: Vec<_> =
        matches.iter().zip(&report.map).filter(|(_, (_, holds))| *holds).map(|(m, _)| m).collect();
    if held.is_empty() {
        return Err(apart("the matches of their places contradict each other"));
    }
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for m in &held {
        let of_second = keyframes[m.query].segment;
        if joined.iter().all(|(second, _)| *second != of_second) {
            joined.push((of_second, keyframes[m.candidate].segment));
        }
    }
    let last = first.keyframes.last();
    let (frame, way_m) = last.map_or((0, 0.0), |k| (k.frame.saturating_add(1), k.way_m));
    for (keyframe, corrected) in keyframes[own..].iter_mut().zip(&ego.frames) {
        keyframe.world_from_camera = corrected.world_from_camera;
        keyframe.frame = keyframe.frame.saturating_add(frame);
        keyframe.way_m += way_m;
        let known = joined.iter().find(|(second, _)| *second == keyframe.segment);
        keyframe.segment = known.map_or(keyframe.segment, |(_, first)| *first);
    }
    let after: Vec<Pose<World, Camera>> = ego.frames.iter().map(|f| f.world_from_camera).collect();
    let (matches, most_bent_m) = (held.len(), bent_m(&before, &after));
    Ok(MergedMap {
        map: PlaceMap { camera: first.camera, height_m: first.height_m, keyframes },
        matches,
        most_bent_m,
    })
}

/// The keyframes of both maps, and the matches of the second one's with the first one's.
fn search(first: &PlaceMap, second: &PlaceMap, free: usize, config: &Config) -> FoundPlaces {
    let mut search = PlaceSearch::new(second.camera, config.places);
    first.keyframes.iter().for_each(|keyframe| search.add(keyframe.clone()));
    for keyframe in &second.keyframes {
        let keyframe = PlacedKeyframe { segment: keyframe.segment.saturating_add(free), ..keyframe.clone() };
        // Loops within the second map were closed when it was made.
        search.take(keyframe, |_, earlier, _| earlier.segment < free);
    }
    search.finish()
}

/// The keyframes as a drive; between maps that no place joined nothing was measured.
fn way(keyframes: &[PlacedKeyframe], height_m: f64, config: &Config) -> EgoTrajectory {
    let poses: Vec<Pose<World, Camera>> = keyframes.iter().map(|k| k.world_from_camera).collect();
    let times_ns: Vec<i64> = (0..poses.len() as i64).map(|k| k * STEP_NS).collect();
    let height_m = Some(height_m).filter(|h| HEIGHT_RANGE_M.contains(h)).unwrap_or(USUAL_HEIGHT_M);
    let advanced = &config.scale.advanced;
    let odometry = OdometryTrajectory::from_poses(&poses, &times_ns);
    let mut ego = EgoTrajectory::metric(&odometry, &[], height_m, advanced.bias_sigma, advanced);
    for (k, pair) in keyframes.windows(2).enumerate() {
        if pair[0].segment != pair[1].segment {
            ego.frames[k + 1].step_measured = false;
            ego.frames[k + 1].step_covariance = Matrix6::identity() * 1e4;
        }
    }
    ego
}

/// Farthest that a pose moved against the first one \[m\].
fn bent_m(before: &[Pose<World, Camera>], after: &[Pose<World, Camera>]) -> f64 {
    let (Some(b), Some(a)) = (before.first(), after.first()) else { return 0.0 };
    let moved = *a * b.inverse();
    let off = |(b, a): (&Pose<World, Camera>, &Pose<World, Camera>)| {
        ((moved * *b).translation() - a.translation()).norm()
    };
    before.iter().zip(after).map(off).fold(0.0, f64::max)
}
