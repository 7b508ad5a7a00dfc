//! Two kept maps that share places made one.

use motorcade_dataset::HEIGHT_RANGE_M;
use motorcade_geometry::{Camera, Pose, World};
use motorcade_graph::Stop;
use motorcade_multibody::{LoopSolve, MapEdge, PlaceEdges, close_loops};
use motorcade_odometry::{EgoTrajectory, OdometryTrajectory};
use motorcade_places::{FoundPlaces, PlaceMap, PlaceSearch, PlacedKeyframe};
use nalgebra::Matrix6;

use crate::config::Config;
use crate::error::{Error, Result};

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
        keyframe_covariance: keyframes[m.candidate].covariance,
        camera_from_keyframe: m.query_from_candidate,
        covariance: m.covariance,
    };
    let edges = PlaceEdges { loops: Vec::new(), map: matches.iter().map(edge).collect() };
    if edges.is_empty() {
        return Err(apart("no place of the second one is seen in the first"));
    }
    let mut ego = way(&keyframes[own..], second.height_m, config);
    let before: Vec<Pose<World, Camera>> = ego.frames.iter().map(|f| f.world_from_camera).collect();
    let interval_s = config.loops.advanced.map_step_s;
    let solve = LoopSolve { graph: &config.graph, interval_s, threads: 1, stop: Stop::NEVER };
    let report = close_loops(&mut ego, &edges, &config.loops, &solve)
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
        keyframe.covariance = corrected.covariance;
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
    let step_ns = (config.loops.advanced.map_step_s * 1e9).round() as i64;
    let times_ns: Vec<i64> = (0..poses.len() as i64).map(|k| k * step_ns).collect();
    // A map whose camera has a height that none has.
    let height_m =
        Some(height_m).filter(|h| HEIGHT_RANGE_M.contains(h)).unwrap_or(config.scale.height.guess_m);
    let advanced = &config.scale.advanced.metric;
    let odometry = OdometryTrajectory::from_poses(&poses, &times_ns, &config.odometry.advanced.external);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circle::{CAMERA, ROUND, Scene, scene};
    use motorcade_places::{FramePlacement, place_keyframes};
    use nalgebra::Vector6;

    /// The keyframes of some frames in the world `world_from_scene`.
    fn map(scene: &Scene, frames: std::ops::Range<usize>, world_from_scene: Pose<World, World>) -> PlaceMap {
        let of = scene.places.iter().filter(|k| frames.contains(&k.frame)).cloned().collect();
        let placement = |frame: usize| FramePlacement {
            world_from_camera: world_from_scene * scene.truth[frame],
            covariance: Matrix6::zeros(),
            way_m: frame as f64,
        };
        let keyframes = place_keyframes(&CAMERA, of, placement, &Config::default().places);
        PlaceMap { camera: CAMERA, height_m: 1.65, keyframes }
    }

    #[test]
    fn maps_that_share_places_are_one_in_the_world_of_the_first() {
        let scene = scene(2 * ROUND, true);
        let elsewhere = Pose::exp(&Vector6::new(0.01, 1.2, 0.0, 40.0, 0.5, -7.0));
        let first = map(&scene, 0..120, Pose::identity());
        // The second round from before the end of the first map on.
        let second = map(&scene, ROUND + 40..ROUND + 200, elsewhere);
        let merged = merge_maps(&first, &second, &Config::default()).unwrap();
        let keyframes = &merged.map.keyframes;
        assert_eq!(keyframes.len(), first.keyframes.len() + second.keyframes.len());
        assert!(merged.matches >= 15 && merged.map.summary().segments == 1, "{}", merged.matches);
        for (found, own) in keyframes[first.keyframes.len()..].iter().zip(&second.keyframes) {
            let truth = scene.truth[own.frame];
            let off = (found.world_from_camera.translation() - truth.translation()).norm();
            assert!(off < 0.4, "frame {}: {off} m", own.frame);
        }
        assert!(PlaceMap::from_bytes(&merged.map.to_bytes()).is_ok());
    }

    #[test]
    fn maps_that_do_not_meet_are_refused() {
        let scene = scene(2 * ROUND, false);
        let first = map(&scene, 0..120, Pose::identity());
        let second = map(&scene, ROUND..ROUND + 120, Pose::identity());
        let error = merge_maps(&first, &second, &Config::default()).unwrap_err();
        assert!(error.to_string().contains("not joined"), "{error}");
        let empty = PlaceMap { keyframes: Vec::new(), ..first.clone() };
        assert!(merge_maps(&empty, &second, &Config::default()).is_err());
        assert!(merge_maps(&first, &empty, &Config::default()).is_err());
    }

    #[test]
    fn values_that_no_drive_has_do_not_stop_the_program() {
        let scene = scene(ROUND, true);
        let first = map(&scene, 0..90, Pose::identity());
        let mut odd = first.clone();
        (odd.height_m, odd.keyframes[3].frame) = (-1e6, usize::MAX);
        for (k, keyframe) in odd.keyframes.iter_mut().enumerate() {
            keyframe.way_m = -1e6;
            keyframe.segment = if k % 2 == 0 { u32::MAX as usize } else { 0 };
            keyframe.landmarks.iter_mut().step_by(2).for_each(|l| {
                (l.point_in_camera, l.depth_sigma) = ([0.0, 0.0, -1e6], -1.0);
            });
        }
        // Refused with a reason, or joined to a map that reads.
        for (a, b) in [(&first, &odd), (&odd, &first)] {
            match merge_maps(a, b, &Config::default()) {
                Ok(merged) => assert!(PlaceMap::from_bytes(&merged.map.to_bytes()).is_ok()),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
}
