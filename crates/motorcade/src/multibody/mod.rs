//! The multi-object graph: camera and vehicle poses of the whole drive, optimised together (the paper's eqs. 9–14).
//!
//! | edge | default | paper |
//! |---|---|---|
//! | camera–camera | odometry with its covariance | odometry, λ = constant |
//! | camera–vehicle | each frame's box with its covariance, Cauchy | the same pose, λ high up to 45 m, low beyond |
//! | vehicle–vehicle | steady motion and no side slip | difference of road-plane places, λ high beyond 45 m |
//!
//! By default a vehicle that stands is one node, a landmark seen from many cameras, and the cameras are held: the lengths of
//! their way are those of the camera's height, exactly. The paper lets vehicles move them (`hold_camera`).

pub(crate) mod edges;
mod motion_factors;

use motorcade_geometry::{Pose, Vehicle, World, lie::se3::adjoint};
use motorcade_graph::{Graph, GraphError, Marginals, Options, Report, VariableId, optimise};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_vehicles::VehicleTrajectory;
use nalgebra::{Isometry3, Matrix6};
use serde::{Deserialize, Serialize};

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
    /// Vehicles are placed against the camera's way as odometry and road give it. False lets them move the camera, as in the
    /// paper: boxes of one vehicle err alike, and sizes of its class say less of lengths than the camera's height.
    pub hold_camera: bool,
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
    /// Its scale \[standard deviations\]: boxes err with heavy tails.
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
            hold_camera: true,
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
            if frame == 0 || options.hold_camera {
                out.graph.fix(id)?;
            }
            out.cameras.push(id);
        }
        let mut all = edges::of_cameras(&out.cameras, ego, options)?;
        for vehicle in vehicles {
            let nodes = out.vehicle_nodes(vehicle, options);
            all.extend(edges::of_vehicle(vehicle, &nodes, &out.cameras, ego, options)?);
            out.vehicles.push(nodes);
        }
        for edge in all {
            out.graph.add_boxed(edge)?;
        }
        Ok(out)
    }

    fn node(&mut self, node: Node, pose: &Isometry3<f64>) -> VariableId {
        let id = self.graph.add_variable(*pose);
        self.nodes.push((node, id));
        id
    }

    /// A node a state; one for all states of a vehicle that stands.
    fn vehicle_nodes(&mut self, vehicle: &VehicleTrajectory, options: &GraphOptions) -> Vec<VariableId> {
        let stands = edges::stands(vehicle, options);
        let mut ids: Vec<VariableId> = Vec::with_capacity(vehicle.states.len());
        for state in &vehicle.states {
            let id = match ids.first() {
                Some(first) if stands => *first,
                _ => self.node(
                    Node::Vehicle { id: vehicle.id, frame: state.frame },
                    state.world_from_vehicle.isometry(),
                ),
            };
            ids.push(id);
        }
        ids
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
                let (frame, camera) = (&ego.frames[state.frame], self.cameras[state.frame]);
                let pose = &state.world_from_vehicle;
                state.covariance = vehicle_covariance(&self.graph, &marginals, frame, pose, [camera, *id])?;
            }
        }
        Ok(report)
    }
}

/// Covariance of a vehicle in the world: that of its camera, carried over, and that of the vehicle relative to the camera.
/// The graph takes the steps of the camera as independent and would make the first part too small; the trajectory
/// knows how long errors of scale last.
pub(crate) fn vehicle_covariance(
    graph: &Graph,
    marginals: &Marginals,
    frame: &EgoFrame,
    world_from_vehicle: &Pose<World, Vehicle>,
    [camera, vehicle]: [VariableId; 2],
) -> Result<Matrix6<f64>, GraphError> {
    let camera_from_vehicle = (frame.world_from_camera.inverse() * *world_from_vehicle).isometry().to_owned();
    let across = adjoint(&camera_from_vehicle.inverse());
    let carried = across * frame.covariance * across.transpose();
    if graph.is_fixed(camera) {
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
