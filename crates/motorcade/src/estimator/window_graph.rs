//! The multi-object graph of a window of frames. Measurements within the window are put in anew with every frame, as sizes,
//! headings and scales become better known; what leaves it stays as a prior on what remains.

use std::collections::{BTreeMap, VecDeque};

use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_graph::{FactorId, Graph, GraphError, Marginals, Options, Solver, VariableId, marginalise};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{VehicleState, VehicleTrajectory};
use nalgebra::Isometry3;

use super::options::OnlineOptions;
use crate::multibody::classes::ClassScales;
use crate::multibody::edges::{self, Build, Own};
use crate::multibody::track_scales::TrackScales;
use crate::multibody::{CameraCoupling, GraphOptions, place, starts, tell_size, vehicle_covariance};

/// A vehicle whose front end turns by more was taken for the wrong way round, and begins anew \[rad\].
const FLIPPED_RAD: f64 = 1.0;

/// The graph of the window.
#[derive(Default)]
pub(super) struct WindowGraph {
    graph: Graph,
    solver: Option<Solver>,
    /// Edges of the window, not those of the prior.
    recent: Vec<FactorId>,
    /// Row of the run of the first camera.
    first: usize,
    cameras: VecDeque<VariableId>,
    vehicles: BTreeMap<usize, Nodes>,
    /// Scales of each vehicle, where views share them.
    scales_of: BTreeMap<usize, TrackScales>,
    /// Windows are too short to re-estimate covariances: all stay at 1.
    scales: ClassScales,
}

/// The poses of a vehicle.
enum Nodes {
    /// It stands.
    One(VariableId),
    /// By row of the run.
    Moving(BTreeMap<usize, VariableId>),
}

impl Nodes {
    fn all(&self) -> Vec<VariableId> {
        match self {
            Self::One(id) => vec![*id],
            Self::Moving(nodes) => nodes.values().copied().collect(),
        }
    }
}

impl WindowGraph {
    /// The camera of a row, when it is in the window.
    pub(super) fn camera(&self, row: usize) -> Option<Pose<World, Camera>> {
        let id = self.cameras.get(row.checked_sub(self.first)?)?;
        self.graph.values().get::<Isometry3<f64>>(*id).ok().map(|p| Pose::new(*p))
    }

    /// Takes a window that ends one frame later than the last one, whose frames count from row `first`, and optimises it:
    /// the newest camera and the newest vehicle poses are put into `ego` and `vehicles`.
    pub(super) fn advance(
        &mut self,
        first: usize,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
        (options, online): (&GraphOptions, &OnlineOptions),
    ) -> Result<(), GraphError> {
        if self.cameras.is_empty() {
            self.first = first;
        }
        self.retire_ended(vehicles)?;
        for edge in std::mem::take(&mut self.recent) {
            self.graph.remove_factor(edge);
        }
        self.retire_changed(first, vehicles, options)?;
        self.place_cameras(ego, options)?;
        let nodes = self.put_edges(first, ego, vehicles, options)?;
        let settings = Options { max_iterations: online.iterations, ..Options::default() };
        let solver = match &mut self.solver {
            Some(solver) => solver,
            none => none.insert(Solver::new(settings)?),
        };
        solver.optimise(&mut self.graph)?;
        self.tell_newest(ego, vehicles, &nodes, options)?;
        if self.cameras.len() >= online.lag_frames {
            self.retire_oldest()?;
        }
        Ok(())
    }

    /// Adds the newest camera; cameras that are held are put where the window has them.
    fn place_cameras(&mut self, ego: &EgoTrajectory, options: &GraphOptions) -> Result<(), GraphError> {
        for (k, frame) in ego.frames.iter().enumerate() {
            let pose = *frame.world_from_camera.isometry();
            match self.cameras.get(k) {
                Some(id) if held(options) => self.graph.values_mut().set(*id, pose)?,
                Some(_) => {}
                None => {
                    let id = self.graph.add_variable(pose);
                    if self.cameras.is_empty() || held(options) {
                        self.graph.fix(id)?;
                    }
                    self.cameras.push_back(id);
                }
            }
        }
        Ok(())
    }

    /// Puts in all edges of the window; returns the nodes of each vehicle's states.
    fn put_edges(
        &mut self,
        first: usize,
        ego: &EgoTrajectory,
        vehicles: &[VehicleTrajectory],
        options: &GraphOptions,
    ) -> Result<Vec<Vec<VariableId>>, GraphError> {
        let cameras: Vec<VariableId> = self.cameras.iter().copied().collect();
        let scales = self.scales.clone();
        let build = Build { ego, cameras: &cameras, options, scales: &scales };
        let mut all = edges::of_cameras(&build)?;
        let mut nodes = Vec::with_capacity(vehicles.len());
        for vehicle in vehicles {
            let starts = starts(vehicle, ego, options);
            let own = self.vehicle_nodes(first, vehicle, &starts, options);
            let scales = self.scale_nodes(vehicle, options);
            all.extend(edges::of_vehicle(vehicle, &Own { nodes: &own, starts: &starts, scales }, &build)?);
            nodes.push(own);
        }
        for edge in all {
            self.recent.push(self.graph.add_boxed(edge.factor)?);
        }
        Ok(nodes)
    }

    /// The scales of a vehicle, where views share them.
    fn scale_nodes(&mut self, vehicle: &VehicleTrajectory, options: &GraphOptions) -> Option<TrackScales> {
        if !edges::shares_size(options) {
            return None;
        }
        let Self { graph, scales_of, .. } = self;
        let scales = scales_of.entry(vehicle.id).or_insert_with(|| TrackScales::add(graph, vehicle));
        scales.complete(graph, vehicle);
        Some(*scales)
    }

    /// The node of each state; new ones where there are none yet.
    fn vehicle_nodes(
        &mut self,
        first: usize,
        vehicle: &VehicleTrajectory,
        starts: &[Pose<World, Vehicle>],
        options: &GraphOptions,
    ) -> Vec<VariableId> {
        let Self { graph, vehicles, .. } = self;
        let Some(start) = starts.first() else { return Vec::new() };
        if edges::stands(vehicle, options) {
            let own = vehicles
                .entry(vehicle.id)
                .or_insert_with(|| Nodes::One(graph.add_variable(*start.isometry())));
            return vec![own.all()[0]; vehicle.states.len()];
        }
        let own = vehicles.entry(vehicle.id).or_insert_with(|| Nodes::Moving(BTreeMap::new()));
        let Nodes::Moving(nodes) = own else { return Vec::new() };
        let node = |(state, start): (&VehicleState, &Pose<World, Vehicle>)| {
            *nodes.entry(first + state.frame).or_insert_with(|| graph.add_variable(*start.isometry()))
        };
        vehicle.states.iter().zip(starts).map(node).collect()
    }

    /// Puts the newest poses, with covariances, into the estimates.
    fn tell_newest(
        &self,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
        nodes: &[Vec<VariableId>],
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        let pose = |id: VariableId| self.graph.values().get::<Isometry3<f64>>(id).copied();
        let (Some(camera), Some(newest)) = (self.cameras.back(), ego.frames.len().checked_sub(1)) else {
            return Ok(());
        };
        let frame = &mut ego.frames[newest];
        frame.world_from_camera = Pose::new(pose(*camera)?);
        let marginals = Marginals::new(&self.graph)?;
        for (vehicle, own) in vehicles.iter_mut().zip(nodes) {
            let (Some(state), Some(node)) = (vehicle.states.last_mut(), own.last()) else { continue };
            if state.frame != newest {
                continue;
            }
            let placed: Pose<World, Vehicle> = Pose::new(pose(*node)?);
            state.covariance = vehicle_covariance(&self.graph, &marginals, frame, &placed, [*camera, *node])?;
            place(state, &placed);
            if let Some(scales) = self.scales_of.get(&vehicle.id) {
                tell_size(&self.graph, &marginals, scales.size, vehicle, options)?;
            }
        }
        Ok(())
    }

    // ---- what leaves ----------------------------------------------------------------------------------------------

    /// Vehicles that are no longer followed: what they said of the cameras stays.
    fn retire_ended(&mut self, vehicles: &[VehicleTrajectory]) -> Result<(), GraphError> {
        let followed = |id: &usize| vehicles.iter().any(|v| v.id == *id);
        let ended: Vec<usize> = self.vehicles.keys().copied().filter(|id| !followed(id)).collect();
        for id in ended {
            self.retire_vehicle(id)?;
        }
        Ok(())
    }

    /// Vehicles that stood and move, or moved and stand, or were the wrong way round, begin anew; nodes of frames that a
    /// vehicle's states no longer reach go. The edges of the window must be out.
    fn retire_changed(
        &mut self,
        first: usize,
        vehicles: &[VehicleTrajectory],
        options: &GraphOptions,
    ) -> Result<(), GraphError> {
        for vehicle in vehicles {
            let Some(nodes) = self.vehicles.get_mut(&vehicle.id) else { continue };
            let same_kind = matches!(nodes, Nodes::One(_)) == edges::stands(vehicle, options);
            if !same_kind || flipped(&self.graph, nodes, first, vehicle) {
                self.retire_vehicle(vehicle.id)?;
                continue;
            }
            let begin = vehicle.states.first().map_or(0, |s| first + s.frame);
            if let Nodes::Moving(nodes) = nodes {
                let reached = nodes.split_off(&begin);
                let left: Vec<VariableId> = std::mem::replace(nodes, reached).into_values().collect();
                retire(&mut self.graph, &left)?;
            }
        }
        Ok(())
    }

    fn retire_vehicle(&mut self, id: usize) -> Result<(), GraphError> {
        let mut nodes = self.vehicles.remove(&id).map_or_else(Vec::new, |n| n.all());
        nodes.extend(self.scales_of.remove(&id).iter().flat_map(TrackScales::nodes));
        retire(&mut self.graph, &nodes)
    }

    fn retire_oldest(&mut self) -> Result<(), GraphError> {
        let mut leaving: Vec<VariableId> = self.cameras.pop_front().into_iter().collect();
        for nodes in self.vehicles.values_mut() {
            if let Nodes::Moving(nodes) = nodes {
                leaving.extend(nodes.remove(&self.first));
            }
        }
        self.first += 1;
        retire(&mut self.graph, &leaving)
    }
}

/// Windows let vehicles move the camera freely or not at all: with every frame lengths are known better, and a way that is bent
/// to fit them anew in a few iterations is told in jumps (4 km of ring road 2.8 % too long).
pub(super) fn held(options: &GraphOptions) -> bool {
    options.camera != CameraCoupling::Free
}

fn retire(graph: &mut Graph, variables: &[VariableId]) -> Result<(), GraphError> {
    if variables.is_empty() { Ok(()) } else { marginalise(graph, variables).map(drop) }
}

/// True when the front end turned a vehicle round since its newest node.
fn flipped(graph: &Graph, nodes: &Nodes, first: usize, vehicle: &VehicleTrajectory) -> bool {
    let turned = |id: &VariableId, row: Option<usize>| {
        let same = |s: &&VehicleState| row.is_none_or(|row| first + s.frame == row);
        let state = vehicle.states.iter().rev().find(same)?;
        let node = graph.values().get::<Isometry3<f64>>(*id).ok()?;
        Some(node.rotation.angle_to(&state.world_from_vehicle.rotation()) > FLIPPED_RAD)
    };
    match nodes {
        Nodes::One(id) => turned(id, None),
        Nodes::Moving(nodes) => nodes.iter().next_back().and_then(|(row, id)| turned(id, Some(*row))),
    }
    .unwrap_or(false)
}
