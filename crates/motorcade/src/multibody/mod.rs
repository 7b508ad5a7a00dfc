//! The multi-object graph: camera and vehicle poses of the whole drive, optimised together (the paper's eqs. 9–14).
//!
//! | edge | default | paper |
//! |---|---|---|
//! | camera–camera | odometry with its covariance | odometry, λ = constant |
//! | camera–vehicle | each frame's box with its covariance, Cauchy | the same pose, λ high up to 45 m, low beyond |
//! | vehicle–vehicle | steady motion and no side slip | difference of road-plane places, λ high beyond 45 m |
//!
//! By default a vehicle that stands is one node, a landmark seen from many cameras.

mod motion_factors;

use motorcade_geometry::{Pose, lie::se3::adjoint};
use motorcade_graph::factors::Between;
use motorcade_graph::{
    Cauchy, Dcs, GemanMcClure, Graph, GraphError, Huber, Marginals, Options, Report, Robust, VariableId,
    optimise,
};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Isometry3, Matrix6};
use serde::{Deserialize, Serialize};

use motion_factors::{NoSideSlip, SteadyMotion};

/// Robust kernels of camera–vehicle edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GraphKernel {
    /// Least squares.
    None,
    /// Huber.
    Huber,
    /// Cauchy.
    #[default]
    Cauchy,
    /// Geman–McClure.
    GemanMcClure,
    /// Dynamic covariance scaling.
    Dcs,
}

/// What the graph holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraphOptions {
    /// False leaves the estimates of the front end as they are.
    pub enabled: bool,
    /// Camera–camera edges.
    pub camera_camera: bool,
    /// Camera–vehicle edges.
    pub camera_vehicle: bool,
    /// Vehicle–vehicle edges: motion model, or the paper's road-plane differences.
    pub vehicle_vehicle: bool,
    /// The paper's constant weights λ instead of covariances (eq. 15).
    pub constant_weights: bool,
    /// λ of camera–camera edges.
    pub lambda_camera: f64,
    /// λ of the trusted and of the less trusted vehicle edges.
    pub lambda_trusted: f64,
    /// λ of the less trusted vehicle edges.
    pub lambda_doubted: f64,
    /// Depth up to which camera–vehicle edges are the trusted ones \[m\].
    pub near_limit_m: f64,
    /// Robust kernel of camera–vehicle edges.
    pub kernel: GraphKernel,
    /// Its scale \[standard deviations\]: boxes err with heavy tails, and at one standard deviation the camera is no longer
    /// dragged along by those that are wrong.
    pub kernel_scale: f64,
    /// Variance of a camera–vehicle edge is multiplied by this: boxes of neighbouring frames err alike.
    pub correlated_frames: f64,
    /// Iterations at most.
    pub max_iterations: usize,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self {
            enabled: true,
            camera_camera: true,
            camera_vehicle: true,
            vehicle_vehicle: true,
            constant_weights: false,
            lambda_camera: 1e4,
            lambda_trusted: 1e2,
            lambda_doubted: 1.0,
            near_limit_m: 45.0,
            kernel: GraphKernel::Cauchy,
            kernel_scale: 1.0,
            correlated_frames: 4.0,
            max_iterations: 100,
        }
    }
}

/// A node's meaning, for the sidecar of `graph.g2o`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Node {
    /// `world_from_camera` of a frame (row of the run).
    Camera {
        /// Row of the run.
        frame: usize,
    },
    /// `world_from_vehicle` of a vehicle at a frame; a standing vehicle has one node, of its first frame.
    Vehicle {
        /// Identity.
        id: usize,
        /// Row of the run.
        frame: usize,
    },
}

/// The graph of a drive: its solver form and what its nodes mean.
pub struct Multibody {
    /// The graph.
    pub graph: Graph,
    /// Nodes in order of their number in `graph.g2o`.
    pub nodes: Vec<(Node, VariableId)>,
    cameras: Vec<VariableId>,
    /// One list a vehicle, one node a state; a standing vehicle repeats its node.
    vehicles: Vec<Vec<VariableId>>,
}

/// A vehicle that moves with less probability is one node.
const STANDING: f64 = 0.5;

impl Multibody {
    /// Builds the graph from odometry and vehicles.
    ///
    /// # Errors
    /// A pose or covariance that is not finite.
    pub fn new(
        ego: &EgoTrajectory,
        vehicles: &[VehicleTrajectory],
        options: &GraphOptions,
    ) -> Result<Self, GraphError> {
        let mut out =
            Self { graph: Graph::new(), nodes: Vec::new(), cameras: Vec::new(), vehicles: Vec::new() };
        for (frame, e) in ego.frames.iter().enumerate() {
            let id = out.node(Node::Camera { frame }, e.world_from_camera.isometry());
            out.cameras.push(id);
        }
        if let Some(first) = out.cameras.first() {
            out.graph.fix(*first)?;
        }
        if options.camera_camera {
            out.add_odometry(ego, options)?;
        }
        for vehicle in vehicles {
            out.add_vehicle(vehicle, ego, options)?;
        }
        Ok(out)
    }

    fn node(&mut self, node: Node, pose: &Isometry3<f64>) -> VariableId {
        let id = self.graph.add_variable(*pose);
        self.nodes.push((node, id));
        id
    }

    fn add_odometry(&mut self, ego: &EgoTrajectory, options: &GraphOptions) -> Result<(), GraphError> {
        for k in 1..ego.frames.len() {
            let (a, b) = (&ego.frames[k - 1], &ego.frames[k]);
            let step = a.world_from_camera.inverse() * b.world_from_camera;
            let information = if options.constant_weights {
                Matrix6::identity() * options.lambda_camera
            } else {
                inverse(&b.step_covariance)
            };
            self.graph.add_factor(Between::new(
                self.cameras[k - 1],
                self.cameras[k],
                *step.isometry(),
                information,
            )?)?;
        }
        Ok(())
    }

    fn add_vehicle(
        &mut self,
        vehicle: &VehicleTrajectory,
        ego: &EgoTrajectory,
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        let standing = vehicle.p_moving < STANDING && !options.constant_weights;
        let mut ids: Vec<VariableId> = Vec::with_capacity(vehicle.states.len());
        for state in &vehicle.states {
            let id = match ids.first() {
                Some(first) if standing => *first,
                _ => self.node(
                    Node::Vehicle { id: vehicle.id, frame: state.frame },
                    state.world_from_vehicle.isometry(),
                ),
            };
            ids.push(id);
        }
        if options.camera_vehicle {
            let seen = vehicle.states.iter().filter(|s| s.measured.is_some()).count();
            // All views of a standing vehicle share their errors of size and slope.
            let share = if standing {
                options.correlated_frames.max(seen as f64 / 4.0)
            } else {
                options.correlated_frames
            };
            for (state, id) in vehicle.states.iter().zip(&ids) {
                self.add_sighting(state, *id, share, options)?;
            }
        }
        if options.vehicle_vehicle && !standing {
            self.add_motion(vehicle, &ids, ego, options)?;
        }
        self.hold_loose(vehicle, &ids, options)?;
        self.vehicles.push(ids);
        Ok(())
    }

    fn add_sighting(
        &mut self,
        state: &VehicleState,
        vehicle: VariableId,
        share: f64,
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        let Some(measured) = &state.measured else { return Ok(()) };
        let camera = self.cameras[state.frame];
        let pose = *measured.camera_from_vehicle.isometry();
        if options.constant_weights {
            let near = pose.translation.vector.z <= options.near_limit_m;
            let lambda = if near { options.lambda_trusted } else { options.lambda_doubted };
            return self
                .graph
                .add_factor(Between::new(camera, vehicle, pose, Matrix6::identity() * lambda)?)
                .map(drop);
        }
        let information = inverse(&(measured.covariance * share));
        let edge = Between::new(camera, vehicle, pose, information)?;
        let c = options.kernel_scale;
        match options.kernel {
            GraphKernel::None => self.graph.add_factor(edge),
            GraphKernel::Huber => self.graph.add_factor(Robust::new(edge, Huber { c })),
            GraphKernel::Cauchy => self.graph.add_factor(Robust::new(edge, Cauchy { c })),
            GraphKernel::GemanMcClure => self.graph.add_factor(Robust::new(edge, GemanMcClure { c })),
            GraphKernel::Dcs => self.graph.add_factor(Robust::new(edge, Dcs { phi: c * c })),
        }
        .map(drop)
    }

    fn add_motion(
        &mut self,
        vehicle: &VehicleTrajectory,
        ids: &[VariableId],
        ego: &EgoTrajectory,
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        if options.constant_weights {
            return self.add_road_plane_steps(vehicle, ids, ego, options);
        }
        // Per step of a tenth of a second: 0.03 rad of yaw (0.3 rad/s per s over 0.1 s), 1.5 m/s² along, 0.5 m/s² across.
        let sigmas = [0.01, 0.01, 0.004, 0.02, 0.01, 0.01];
        let information =
            Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|k, _| 1.0 / (sigmas[k] * sigmas[k])));
        for w in ids.windows(3) {
            self.graph.add_factor(SteadyMotion::new([w[0], w[1], w[2]], &information))?;
        }
        for (w, state) in ids.windows(2).zip(&vehicle.states) {
            // Standing still a vehicle's heading does not show in its motion; the factor then says nothing of it anyway.
            let sideways = if state.speed_mps.abs() > 1.0 { 0.02 } else { 0.05 };
            self.graph.add_factor(NoSideSlip::new([w[0], w[1]], [0.01, 0.01, sideways, 0.03]))?;
        }
        Ok(())
    }

    /// The paper's vehicle–vehicle edges: differences of road-plane places, registered by odometry.
    fn add_road_plane_steps(
        &mut self,
        vehicle: &VehicleTrajectory,
        ids: &[VariableId],
        ego: &EgoTrajectory,
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        let place = |s: &VehicleState| {
            Some((ego.frames[s.frame].world_from_camera * s.measured?.camera_from_vehicle, s.measured?))
        };
        for (w, pair) in ids.windows(2).zip(vehicle.states.windows(2)) {
            let (Some((a, _)), Some((b, seen))) = (place(&pair[0]), place(&pair[1])) else { continue };
            let far = seen.camera_from_vehicle.translation().z > options.near_limit_m;
            let lambda = if far { options.lambda_trusted } else { options.lambda_doubted };
            let step = *(a.inverse() * b).isometry();
            self.graph.add_factor(Between::new(w[0], w[1], step, Matrix6::identity() * lambda)?)?;
        }
        Ok(())
    }

    /// A weak tie of every vehicle node to its camera at the front end's estimate, so that no choice of edges leaves a
    /// node free: ten metres, one radian.
    fn hold_loose(
        &mut self,
        vehicle: &VehicleTrajectory,
        ids: &[VariableId],
        _options: &GraphOptions,
    ) -> Result<(), GraphError> {
        let weak = Matrix6::from_diagonal(&nalgebra::Vector6::new(1.0, 1.0, 1.0, 0.01, 0.01, 0.01));
        for (k, (state, id)) in vehicle.states.iter().zip(ids).enumerate() {
            if k > 0 && ids[k - 1] == *id {
                continue;
            }
            let world_from_camera = self.graph.values().get::<Isometry3<f64>>(self.cameras[state.frame])?;
            let pose = world_from_camera.inverse() * state.world_from_vehicle.isometry();
            self.graph.add_factor(Between::new(self.cameras[state.frame], *id, pose, weak)?)?;
        }
        Ok(())
    }

    /// Optimises the graph and puts the result, with covariances, into the trajectories.
    ///
    /// # Errors
    /// A graph that cannot be solved; the trajectories then stay as they were.
    pub fn solve(
        &mut self,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
        options: &GraphOptions,
        threads: usize,
    ) -> Result<Report, GraphError> {
        let settings = Options { max_iterations: options.max_iterations, threads, ..Options::default() };
        let report = optimise(&mut self.graph, &settings)?;
        let marginals = Marginals::new(&self.graph)?;
        let values = self.graph.values();
        for (frame, id) in ego.frames.iter_mut().zip(&self.cameras) {
            frame.world_from_camera = Pose::new(*values.get::<Isometry3<f64>>(*id)?);
        }
        for (vehicle, ids) in vehicles.iter_mut().zip(&self.vehicles) {
            for (state, id) in vehicle.states.iter_mut().zip(ids) {
                state.world_from_vehicle = Pose::new(*values.get::<Isometry3<f64>>(*id)?);
                state.covariance = self.vehicle_covariance(&marginals, ego, state, *id)?;
            }
        }
        Ok(report)
    }

    /// Covariance of a vehicle in the world: that of its camera, carried over, and that of the vehicle relative to the camera.
    /// The graph takes the steps of the camera as independent and would make the first part too small; the trajectory
    /// knows how long errors of scale last.
    fn vehicle_covariance(
        &self,
        marginals: &Marginals,
        ego: &EgoTrajectory,
        state: &VehicleState,
        vehicle: VariableId,
    ) -> Result<Matrix6<f64>, GraphError> {
        let frame = &ego.frames[state.frame];
        let camera_from_vehicle =
            (frame.world_from_camera.inverse() * state.world_from_vehicle).isometry().to_owned();
        let across = adjoint(&camera_from_vehicle.inverse());
        let carried = across * frame.covariance * across.transpose();
        let camera = self.cameras[state.frame];
        if self.graph.is_fixed(camera) {
            let dense = marginals.covariance(vehicle)?;
            return Ok(carried + Matrix6::from_fn(|r, c| dense[(r, c)]));
        }
        // Error of camera_from_vehicle: δ_vehicle − Ad(camera_from_vehicle⁻¹) δ_camera.
        let joint = marginals.joint(&[camera, vehicle])?;
        let block = |r: usize, c: usize| Matrix6::from_fn(|i, j| joint[(r + i, c + j)]);
        let cross = across * block(0, 6);
        let relative = block(6, 6) + across * block(0, 0) * across.transpose() - cross - cross.transpose();
        Ok(carried + relative)
    }
}

/// Inverse of a covariance; a singular one is loosened until it has one.
fn inverse(covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let mut loose = (covariance + covariance.transpose()) * 0.5;
    for _ in 0..8 {
        if let Some(factor) = loose.cholesky() {
            let information = factor.inverse();
            return (information + information.transpose()) * 0.5;
        }
        loose += Matrix6::identity() * (1e-9 + 1e-3 * loose.trace().abs());
    }
    Matrix6::identity()
}
