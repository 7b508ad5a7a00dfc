//! The multi-object graph: camera and vehicle poses of the whole drive, optimised together (the paper's eqs. 9–14).
//!
//! | edge | default | paper |
//! |---|---|---|
//! | camera–camera | odometry with its covariance | odometry, λ = constant |
//! | camera–vehicle | each frame's box and keypoints, their covariances with the scale of the size held, Cauchy | the pose of all sources together, λ high up to 45 m, low beyond |
//! | scale of the size | one variable a vehicle, shared by its camera–vehicle edges, with what is known of it | – |
//! | scale of distances | the same for poses that were given, whose front end had a size of its own in mind | – |
//! | vehicle–vehicle | steady motion and no side slip | difference of road-plane places, λ high beyond 45 m |
//!
//! By default a vehicle that stands is one node, a landmark seen from many cameras. Where odometry broke off, landmarks tell how
//! the way goes on; steps that odometry measured stay as they are ([`CameraCoupling`]).

pub(crate) mod classes;
pub(crate) mod edges;
pub(crate) mod medoid;
mod motion_factors;
mod sized_sighting;
#[cfg(test)]
mod tests;
pub(crate) mod track_scales;
mod variance;

use motorcade_geometry::{Pose, Vehicle, World, lie::se3::adjoint};
use motorcade_graph::factors::Between;
use motorcade_graph::{FactorId, Graph, GraphError, Marginals, Options, Report, VariableId, optimise};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::{Isometry3, Matrix6, Vector3};
use serde::{Deserialize, Serialize};

use classes::{ClassScales, EdgeClass};
use edges::{Build, Own};
use sized_sighting::ScaledPoseFactor;
use track_scales::{TrackScales, scale_weight};
pub use variance::VarianceFactor;

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

/// What vehicles may do to the camera's way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraCoupling {
    /// Nothing: vehicles are placed against the way as odometry and road give it.
    Held,
    /// Move it where odometry broke off or guessed: a step measured from hundreds of corners and the road is held whole, and with
    /// it the proportion of all lengths to the camera's height. Online the same as `Held`.
    #[default]
    StepsHeld,
    /// Bend it too, each measured step keeping its length. Online the same as `Held`.
    LengthsHeld,
    /// Stretch it too, as in the paper.
    Free,
}

/// What the graph holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraphOptions {
    /// False leaves the estimates of the front end as they are.
    pub enabled: bool,
    /// What vehicles may do to the camera's way.
    pub camera: CameraCoupling,
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
    /// Views of a vehicle share a variable for the scale of its size; false puts the size's uncertainty into each view's
    /// covariance, as if views had sizes of their own.
    pub shared_size: bool,
    /// Times the scale of the covariances of each class of camera–vehicle edges is re-estimated from its residuals; 0 leaves
    /// them. Online windows are too short for it, and constant weights have none.
    pub variance_rounds: usize,
    /// Tracks start at the medoid of what their views say; false starts them where the front end has them.
    pub medoid_start: bool,
    /// Iterations at most.
    pub max_iterations: usize,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self {
            enabled: true,
            camera: CameraCoupling::default(),
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
            shared_size: true,
            variance_rounds: 3,
            medoid_start: true,
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
    /// Poses in order of their number in `graph.g2o`.
    pub nodes: Vec<(Node, VariableId)>,
    /// What the covariances of each class were multiplied by.
    pub variance_factors: Vec<VarianceFactor>,
    cameras: Vec<VariableId>,
    vehicles: Vec<Body>,
    /// Edges that count for the factors of their class.
    classed: Vec<(FactorId, EdgeClass)>,
    scales: ClassScales,
}

/// A vehicle in the graph.
#[derive(Default)]
struct Body {
    /// One node a state; a standing vehicle repeats its node.
    nodes: Vec<VariableId>,
    scales: Option<TrackScales>,
    /// Edges to the cameras.
    sightings: Vec<(EdgeClass, ScaledPoseFactor)>,
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
        let mut out = Self {
            graph: Graph::new(),
            nodes: Vec::new(),
            variance_factors: Vec::new(),
            cameras: Vec::new(),
            vehicles: Vec::new(),
            classed: Vec::new(),
            scales: ClassScales::default(),
        };
        let mut held = true;
        for (frame, e) in ego.frames.iter().enumerate() {
            let id = out.node(Node::Camera { frame }, e.world_from_camera.isometry());
            held &= frame == 0 || edges::step_is_held(e, options);
            if held {
                out.graph.fix(id)?;
            }
            out.cameras.push(id);
        }
        let (cameras, scales) = (out.cameras.clone(), out.scales.clone());
        let build = Build { ego, cameras: &cameras, options, scales: &scales };
        for edge in edges::of_cameras(&build)? {
            out.graph.add_boxed(edge.factor)?;
        }
        for vehicle in vehicles {
            let starts = starts(vehicle, ego, options);
            let body = out.body(vehicle, &starts, &build);
            for edge in edges::of_vehicle(vehicle, &body.own(&starts), &build)? {
                let id = out.graph.add_boxed(edge.factor)?;
                // All views of a standing vehicle together count as one: their residuals tell nothing of their noise.
                let tells = edge.class.filter(|_| !edges::stands(vehicle, options));
                out.classed.extend(tells.map(|class| (id, class)));
            }
            out.vehicles.push(body);
        }
        Ok(out)
    }

    fn node(&mut self, node: Node, pose: &Isometry3<f64>) -> VariableId {
        let id = self.graph.add_variable(*pose);
        self.nodes.push((node, id));
        id
    }

    /// A node a state, one for all states of a vehicle that stands; and its size.
    fn body(
        &mut self,
        vehicle: &VehicleTrajectory,
        starts: &[Pose<World, Vehicle>],
        build: &Build<'_>,
    ) -> Body {
        let stands = edges::stands(vehicle, build.options);
        let mut nodes: Vec<VariableId> = Vec::with_capacity(vehicle.states.len());
        for (state, start) in vehicle.states.iter().zip(starts) {
            let id = match nodes.first() {
                Some(first) if stands => *first,
                _ => self.node(Node::Vehicle { id: vehicle.id, frame: state.frame }, start.isometry()),
            };
            nodes.push(id);
        }
        let scales = edges::shares_size(build.options).then(|| TrackScales::add(&mut self.graph, vehicle));
        let sighted = |s: &TrackScales| edges::sized_sightings(vehicle, &nodes, s, build);
        let sightings = scales.as_ref().map_or_else(Vec::new, sighted);
        Body { nodes, scales, sightings }
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
        let mut report = optimise(&mut self.graph, &settings)?;
        for _ in 0..if options.constant_weights { 0 } else { options.variance_rounds } {
            let before = self.scales.all();
            self.variance_factors = variance::estimate(&self.graph, &self.classed, &self.scales, options)?;
            if self.scales.all() == before {
                break;
            }
            report = optimise(&mut self.graph, &settings)?;
        }
        let marginals = Marginals::new(&self.graph)?;
        let values = self.graph.values();
        for (frame, id) in ego.frames.iter_mut().zip(&self.cameras) {
            frame.world_from_camera = Pose::new(*values.get::<Isometry3<f64>>(*id)?);
        }
        for (vehicle, body) in vehicles.iter_mut().zip(&self.vehicles) {
            for (state, id) in vehicle.states.iter_mut().zip(&body.nodes) {
                let placed = Pose::new(*values.get::<Isometry3<f64>>(*id)?);
                place(state, &placed);
                let (frame, camera) = (&ego.frames[state.frame], self.cameras[state.frame]);
                state.covariance =
                    vehicle_covariance(&self.graph, &marginals, frame, &placed, [camera, *id])?;
            }
            if let Some(scales) = &body.scales {
                tell_size(&self.graph, &marginals, scales.size, vehicle, options)?;
            }
        }
        Ok(report)
    }

    /// The graph of poses alone, nodes in the order of [`Self::nodes`]: sizes at their values, no motion model, no kernels.
    ///
    /// # Errors
    /// None after a graph that was built: the edges are those of the graph.
    pub fn poses_alone(&self) -> Result<(Graph, Vec<VariableId>), GraphError> {
        let (mut graph, values) = (Graph::new(), self.graph.values());
        let mut ids = std::collections::BTreeMap::new();
        for (_, id) in &self.nodes {
            let copy = graph.add_variable(*values.get::<Isometry3<f64>>(*id)?);
            if self.graph.is_fixed(*id) {
                graph.fix(copy)?;
            }
            ids.insert(*id, copy);
        }
        let copy = |id: &VariableId| ids.get(id).copied().ok_or(GraphError::UnknownVariable(*id));
        let mut edges = Vec::new();
        for (_, factor) in self.graph.factors() {
            if let ([a, b], Some(relative)) = (factor.variables(), factor.relative_pose()) {
                edges.push(Between::new(copy(a)?, copy(b)?, *relative.measurement, *relative.information)?);
            }
        }
        for (class, sighting) in self.vehicles.iter().flat_map(|b| &b.sightings) {
            let [camera, vehicle, scale] = sighting.nodes();
            let (pose, information) = sighting.at(values.scalar(scale)?);
            let information = information / self.scales.get(*class);
            edges.push(Between::new(copy(&camera)?, copy(&vehicle)?, pose, information)?);
        }
        for edge in edges {
            graph.add_factor(edge)?;
        }
        let order = self.nodes.iter().map(|(_, id)| copy(id)).collect::<Result<_, _>>()?;
        Ok((graph, order))
    }
}

impl Body {
    fn own<'a>(&'a self, starts: &'a [Pose<World, Vehicle>]) -> Own<'a> {
        Own { nodes: &self.nodes, starts, scales: self.scales }
    }
}

/// Where the nodes of a vehicle start, one a state.
pub(crate) fn starts(
    vehicle: &VehicleTrajectory,
    ego: &EgoTrajectory,
    options: &GraphOptions,
) -> Vec<Pose<World, Vehicle>> {
    if options.medoid_start && !options.constant_weights {
        medoid::starts(vehicle, ego)
    } else {
        vehicle.states.iter().map(|s| s.world_from_vehicle).collect()
    }
}

/// Puts a pose into a state; the speed counts along the nose.
pub(crate) fn place(state: &mut VehicleState, placed: &Pose<World, Vehicle>) {
    let nose = |pose: &Pose<World, Vehicle>| pose.transform_vector(&Vector3::x());
    if nose(placed).dot(&nose(&state.world_from_vehicle)) < 0.0 {
        state.speed_mps = -state.speed_mps;
    }
    state.world_from_vehicle = *placed;
}

/// Puts the size, its scale refined by all views together, and its covariance into a trajectory.
pub(crate) fn tell_size(
    graph: &Graph,
    marginals: &Marginals,
    scale: VariableId,
    vehicle: &mut VehicleTrajectory,
    options: &GraphOptions,
) -> Result<(), GraphError> {
    let variance = marginals.covariance(scale)?[(0, 0)] * scale_weight(options);
    vehicle.rescale(graph.values().scalar(scale)? - vehicle.size.height_m.ln(), variance);
    Ok(())
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
