//! Writing estimates of the graph into trajectories.

use motorcade_geometry::{Pose, Vehicle, World, lie::se3::adjoint};
use motorcade_graph::{Graph, GraphError, Marginals, VariableId};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::times::FrameTimes;
use crate::track_scales::WeightedNode;

/// Solution of a graph.
#[derive(Clone, Copy)]
pub(crate) struct Solution<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) marginals: &'a Marginals,
    /// Node of each frame of the window.
    pub(crate) cameras: &'a [VariableId],
}

impl Solution<'_> {
    fn pose<To, From>(&self, id: VariableId) -> Result<Pose<To, From>, GraphError> {
        Ok(Pose::new(*self.graph.values().get::<Isometry3<f64>>(id)?))
    }

    /// Writes the camera poses of the frames from `from` on.
    pub(crate) fn write_cameras(&self, from: usize, ego: &mut EgoTrajectory) -> Result<(), GraphError> {
        for (frame, id) in ego.frames.iter_mut().zip(self.cameras).skip(from) {
            frame.world_from_camera = self.pose(*id)?;
        }
        Ok(())
    }

    /// Writes poses and covariances of the states of a vehicle from frame `from` on; true when there was one.
    pub(crate) fn write_states(
        &self,
        from: usize,
        vehicle: &mut VehicleTrajectory,
        nodes: &[VariableId],
        scales: &[WeightedNode],
        ego: &EgoTrajectory,
    ) -> Result<bool, GraphError> {
        let mut written = false;
        for (state, id) in vehicle.states.iter_mut().zip(nodes).filter(|(s, _)| s.frame >= from) {
            let estimate: Pose<World, Vehicle> = self.pose(*id)?;
            write_pose(state, &estimate);
            let (frame, camera) = (&ego.frames[state.frame], self.cameras[state.frame]);
            state.covariance = self.vehicle_covariance(frame, &estimate, [camera, *id], scales)?;
            written = true;
        }
        Ok(written)
    }

    /// Writes the speeds of a moving vehicle in the frames from `from` on: along its heading, by its poses before and after. The front end has them by
    /// positions alone, which scatter along the line of sight; its standard deviations stay.
    pub(crate) fn write_speeds(
        &self,
        from: usize,
        vehicle: &mut VehicleTrajectory,
        nodes: &[VariableId],
        times: FrameTimes<'_>,
    ) -> Result<(), GraphError> {
        let last = vehicle.states.len().min(nodes.len()).saturating_sub(1);
        let frames: Vec<usize> = vehicle.states.iter().map(|s| s.frame).collect();
        for (k, state) in vehicle.states.iter_mut().enumerate().take(last + 1) {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            // A standing vehicle has one node.
            if state.frame < from || nodes[before] == nodes[after] {
                continue;
            }
            let (a, b): (Pose<World, Vehicle>, Pose<World, Vehicle>) =
                (self.pose(nodes[before])?, self.pose(nodes[after])?);
            let forward = state.world_from_vehicle.transform_vector(&Vector3::x());
            let way_m = (b.translation() - a.translation()).dot(&forward);
            state.speed_mps = way_m / times.between(frames[before], frames[after]);
        }
        Ok(())
    }

    /// Writes the size of a vehicle, its scale refined by all measurements together, and its covariance. `weight` is that of the
    /// priors of scales.
    pub(crate) fn write_size(
        &self,
        vehicle: &mut VehicleTrajectory,
        scale: VariableId,
        weight: f64,
    ) -> Result<(), GraphError> {
        let variance = self.marginals.covariance(scale)?[(0, 0)] * weight;
        vehicle.rescale(self.graph.values().scalar(scale)? - vehicle.size.height_m.ln(), variance);
        Ok(())
    }

    /// Covariance (6×6) of a vehicle in the world: that of its camera, transformed, plus that of the vehicle relative to the
    /// camera. The graph takes the steps of the camera as independent and would make the first part too small; the trajectory
    /// has the correlation time of the scale's errors.
    fn vehicle_covariance(
        &self,
        frame: &EgoFrame,
        world_from_vehicle: &Pose<World, Vehicle>,
        [camera, vehicle]: [VariableId; 2],
        scales: &[WeightedNode],
    ) -> Result<Matrix6<f64>, GraphError> {
        let camera_from_vehicle =
            (frame.world_from_camera.inverse() * *world_from_vehicle).isometry().to_owned();
        let across = adjoint(&camera_from_vehicle.inverse());
        let of_camera = across * frame.covariance * across.transpose();
        let with_scale = self.with_scales(&across, [camera, vehicle], scales)?;
        if self.graph.is_fixed(camera) {
            let dense = self.marginals.covariance(vehicle)?;
            return Ok(of_camera + Matrix6::from_fn(|r, c| dense[(r, c)]) + with_scale);
        }
        // Error of camera_from_vehicle: δ_vehicle − Ad(camera_from_vehicle⁻¹) δ_camera.
        let joint = self.marginals.joint(&[camera, vehicle])?;
        let block = |r: usize, c: usize| Matrix6::from_fn(|i, j| joint[(r + i, c + j)]);
        let cross = across * block(0, 6);
        let relative = block(6, 6) + across * block(0, 0) * across.transpose() - cross - cross.transpose();
        Ok(of_camera + relative + with_scale)
    }

    /// Missing part of the covariance of a vehicle relative to the camera: the variance of a scale is `weight` times too small, and an error of it moves
    /// the vehicle by `cov(pose, scale) / var(scale)`.
    fn with_scales(
        &self,
        across: &Matrix6<f64>,
        [camera, vehicle]: [VariableId; 2],
        scales: &[WeightedNode],
    ) -> Result<Matrix6<f64>, GraphError> {
        let mut missing = Matrix6::zeros();
        for WeightedNode { id: scale, weight } in scales.iter().filter(|scale| scale.weight > 1.0) {
            let column = |id: VariableId| -> Result<Vector6<f64>, GraphError> {
                let cross = self.marginals.cross(id, *scale)?;
                Ok(Vector6::from_fn(|r, _| cross[(r, 0)]))
            };
            let relative = column(vehicle)? - across * column(camera)?;
            let variance = self.marginals.covariance(*scale)?[(0, 0)];
            if variance > 0.0 {
                missing += relative * relative.transpose() * ((weight - 1.0) / variance);
            }
        }
        Ok(missing)
    }
}

/// Writes a pose into a state; the speed counts along the forward axis.
fn write_pose(state: &mut VehicleState, estimate: &Pose<World, Vehicle>) {
    let forward = |pose: &Pose<World, Vehicle>| pose.transform_vector(&Vector3::x());
    if forward(estimate).dot(&forward(&state.world_from_vehicle)) < 0.0 {
        state.speed_mps = -state.speed_mps;
    }
    state.world_from_vehicle = *estimate;
}
