//! Writing corrected poses and their covariances into the trajectory.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_graph::{Graph, GraphError, Marginals, VariableId};
use motorcade_odometry::EgoTrajectory;
use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use super::edge::MapEdge;

/// The edge of the frame nearest in time, of two the earlier one.
fn nearest<'a>(met: &[&'a MapEdge], frame: usize) -> Option<&'a MapEdge> {
    let after = met.partition_point(|edge| edge.frame < frame);
    let around = [after.checked_sub(1), Some(after)].into_iter().flatten();
    around.filter_map(|k| met.get(k).copied()).min_by_key(|edge| edge.frame.abs_diff(frame))
}

/// Writes poses and covariances; returns how far the camera was moved at most \[m\]. `marginals` has the covariance of each camera. `met` are the edges that hold to a
/// kept map, in order of their frames.
pub(super) fn back(
    graph: &Graph,
    marginals: &Marginals,
    (cameras, met): (&[VariableId], &[&MapEdge]),
    ego: &mut EgoTrajectory,
) -> Result<f64, GraphError> {
    let mut estimates: Vec<(Pose<World, Camera>, Matrix6<f64>)> = Vec::with_capacity(cameras.len());
    for (k, (id, frame)) in cameras.iter().zip(&ego.frames).enumerate() {
        let pose: Pose<World, Camera> = Pose::new(*graph.values().get::<Isometry3<f64>>(*id)?);
        let own = marginals.covariance(*id)?;
        let own = Matrix6::from_fn(|r, c| own[(r, c)]);
        // No loop shows an error of scale that the whole drive shares: positions are wrong by a share of their distance from where they
        // are known, the start of the world or the frame nearest in time at which the map was met.
        let nearest = nearest(met, k);
        let known = match nearest.and_then(|edge| cameras.get(edge.frame)) {
            Some(id) => graph.values().get::<Isometry3<f64>>(*id)?.translation.vector,
            None => Vector3::zeros(),
        };
        let from_start = pose.rotation().inverse() * (pose.translation() - known) * frame.scale_bias_sigma;
        let shared = Vector6::new(0.0, 0.0, 0.0, from_start.x, from_start.y, from_start.z);
        let of_map = nearest.map_or_else(Matrix6::zeros, |edge| edge.covariance_at(&pose));
        estimates.push((pose, own + shared * shared.transpose() + of_map));
    }
    let mut most_moved_m = 0.0_f64;
    for (frame, (pose, covariance)) in ego.frames.iter_mut().zip(estimates) {
        let moved = pose.translation() - frame.world_from_camera.translation();
        most_moved_m = most_moved_m.max(moved.norm());
        frame.world_from_camera = pose;
        frame.covariance = covariance;
    }
    Ok(most_moved_m)
}
