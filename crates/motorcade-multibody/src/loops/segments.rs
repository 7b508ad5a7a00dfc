//! Starting values across breaks: maps of their own are put where places join them.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::EgoTrajectory;

use super::edge::LoopEdge;

type WorldFromCamera = Pose<World, Camera>;

/// The frames at which a new map begins: the first measured step after steps that nothing measured.
fn breaks(ego: &EgoTrajectory) -> Vec<usize> {
    let unmeasured = |k: usize| !ego.frames[k].step_measured;
    (1..ego.frames.len().saturating_sub(1)).filter(|k| unmeasured(*k) && !unmeasured(k + 1)).collect()
}

/// Poses in which each map after a break stands where most of its loops to earlier maps put it. Odometry does not know the motion across
/// a break, and a robust kernel would take all loops over it for outliers.
pub(super) fn joined(ego: &EgoTrajectory, edges: &[LoopEdge]) -> Vec<WorldFromCamera> {
    let mut poses: Vec<WorldFromCamera> = ego.frames.iter().map(|f| f.world_from_camera).collect();
    for begin in breaks(ego) {
        let over: Vec<&LoopEdge> = edges.iter().filter(|e| e.earlier < begin && e.later >= begin).collect();
        let moves: Vec<Pose<World, World>> = over
            .iter()
            .map(|e| poses[e.earlier] * e.later_from_earlier.inverse() * poses[e.later].inverse())
            .collect();
        // The edge whose move brings most of the others' frames nearest to where they belong.
        let cost = |m: &Pose<World, World>| -> f64 {
            let off = |e: &&LoopEdge| {
                let there = *m * poses[e.later];
                (there.inverse() * poses[e.earlier] * e.later_from_earlier.inverse())
                    .translation()
                    .norm()
                    .min(10.0)
            };
            over.iter().map(off).sum()
        };
        let best = moves.iter().map(|m| (cost(m), *m)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, moved)) = best else { continue };
        poses[begin..].iter_mut().for_each(|pose| *pose = moved * *pose);
    }
    poses
}
