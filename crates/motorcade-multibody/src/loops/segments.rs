//! Starting values across breaks: maps of their own are put where places join them.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::EgoTrajectory;

use super::edge::{LoopEdge, MapEdge, PlaceEdges};
use super::options::AdvancedLoopOptions;

type WorldFromCamera = Pose<World, Camera>;

/// The frames at which a new map begins: the first measured step after steps that nothing measured.
fn breaks(ego: &EgoTrajectory) -> Vec<usize> {
    let unmeasured = |k: usize| !ego.frames[k].step_measured;
    (1..ego.frames.len().saturating_sub(1)).filter(|k| unmeasured(*k) && !unmeasured(k + 1)).collect()
}

/// Poses in which the drive stands where most of its edges to a kept map put it, and each map after a break where most of its edges to
/// earlier maps do. Odometry does not know the motion across a break, and a robust kernel would take all edges over it for outliers.
pub(super) fn joined(
    ego: &EgoTrajectory,
    edges: &PlaceEdges,
    options: &AdvancedLoopOptions,
) -> Vec<WorldFromCamera> {
    let mut poses: Vec<WorldFromCamera> = ego.frames.iter().map(|f| f.world_from_camera).collect();
    let known = |edge: &MapEdge| (edge.frame, edge.world_from_camera());
    let of_map: Vec<(usize, WorldFromCamera)> = edges.map.iter().map(known).collect();
    let breaks = breaks(ego);
    // Edges of later maps say nothing of where the first one lies.
    let first = breaks.first().copied().unwrap_or(poses.len());
    let of_first: Vec<_> = of_map.iter().copied().filter(|(frame, _)| *frame < first).collect();
    put(&mut poses, 0, if of_first.is_empty() { &of_map } else { &of_first }, options);
    for begin in breaks {
        let over = edges.loops.iter().filter(|e| e.earlier < begin && e.later >= begin);
        let place = |e: &LoopEdge| Some((e.later, *poses.get(e.earlier)? * e.later_from_earlier.inverse()));
        let mut places: Vec<(usize, WorldFromCamera)> = over.filter_map(place).collect();
        places.extend(of_map.iter().filter(|(frame, _)| *frame >= begin));
        put(&mut poses, begin, &places, options);
    }
    poses
}

/// Moves the poses from `begin` on by the move of the one place that brings most of the other frames nearest to where they belong.
fn put(
    poses: &mut [WorldFromCamera],
    begin: usize,
    places: &[(usize, WorldFromCamera)],
    options: &AdvancedLoopOptions,
) {
    let places: Vec<(WorldFromCamera, WorldFromCamera)> =
        places.iter().filter_map(|(frame, there)| Some((*poses.get(*frame)?, *there))).collect();
    let cost = |m: &Pose<World, World>| -> f64 {
        let off = |(here, there): &(WorldFromCamera, WorldFromCamera)| {
            ((*m * *here).inverse() * *there).translation().norm().min(options.elsewhere_m)
        };
        places.iter().map(off).sum()
    };
    let moves = places.iter().map(|(here, there)| *there * here.inverse());
    let best = moves.map(|m| (cost(&m), m)).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, moved)) = best {
        poses.iter_mut().skip(begin).for_each(|pose| *pose = moved * *pose);
    }
}
