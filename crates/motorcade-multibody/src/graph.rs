//! The graph of a window of frames: the whole drive, or its last seconds.

mod state;

use std::collections::{BTreeMap, VecDeque};

use motorcade_geometry::{Camera, Pose, World};
use motorcade_graph::solver::Termination;
use motorcade_graph::{FactorId, FixedLag, GraphError, Marginals, Options, Report, Stop, VariableId};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::VehicleTrajectory;
use nalgebra::Isometry3;

use crate::classes::{ClassGroups, EdgeClass};
use crate::edges::{self, EdgeContext, TrackNodes};
use crate::estimates::Solution;
use crate::loops::{LoopOptions, PlaceEdges};
use crate::nodes::{Node, PoseNodes, VehicleNodes};
use crate::options::{CameraCoupling, GraphOptions};
use crate::start;
use crate::times::FrameTimes;
use crate::track_scales::{TrackScales, scale_weight};
use crate::variance::{self, VarianceFactor};

pub use state::MultibodyGraphState;

/// Frames of a window.
#[derive(Clone, Copy, Debug)]
pub struct WindowFrames<'a> {
    /// Row of the run of the first frame. Frames before it leave the graph; what they measured remains as a prior.
    pub first: usize,
    /// Time of each frame \[s\], from any origin.
    pub times_s: &'a [f64],
}

/// The multi-object graph of a drive or of its last seconds.
///
/// [`update`](Self::update) takes a window of frames, adds nodes for those that are new, marginalises those that left, puts in
/// all edges of the window with the measurements as known now, optimises, and writes the estimates back. The whole drive is one update
/// of a graph made by [`drive`](Self::drive); online every frame is one of a graph made by [`sliding`](Self::sliding).
#[derive(Debug)]
pub struct MultibodyGraph {
    options: GraphOptions,
    /// As it applies to this kind of window.
    coupling: CameraCoupling,
    /// True for the whole drive: covariances are re-estimated and all frames are written back.
    whole_drive: bool,
    window: FixedLag,
    /// Row of the run of the first camera.
    first: usize,
    cameras: VecDeque<VariableId>,
    /// True while all cameras so far are fixed.
    all_fixed: bool,
    vehicles: BTreeMap<usize, VehicleNodes>,
    groups: ClassGroups,
    /// Edges from which covariances are re-estimated.
    counted: Vec<(FactorId, EdgeClass)>,
    variance_factors: Vec<VarianceFactor>,
    /// Edges of places seen again.
    places: (PlaceEdges, LoopOptions),
}

impl MultibodyGraph {
    /// A graph for the whole drive.
    ///
    /// # Errors
    /// Options out of their range.
    pub fn drive(options: &GraphOptions, threads: usize) -> Result<Self, GraphError> {
        let solver =
            Options { max_iterations: options.advanced.max_iterations, threads, ..Options::default() };
        Self::new(options, options.camera, solver, true)
    }

    /// A graph for the last seconds, with so many iterations an update at most: it starts from the last solution. Vehicles
    /// move the camera freely or not at all: lengths become better known with every frame, and a trajectory bent to fit them in
    /// a few iterations jumps.
    ///
    /// # Errors
    /// Options out of their range.
    pub fn sliding(options: &GraphOptions, iterations: usize) -> Result<Self, GraphError> {
        let free = options.camera == CameraCoupling::Free;
        let coupling = if free { CameraCoupling::Free } else { CameraCoupling::Held };
        let solver = Options { max_iterations: iterations, ..Options::default() };
        Self::new(options, coupling, solver, false)
    }

    fn new(
        options: &GraphOptions,
        coupling: CameraCoupling,
        solver: Options,
        whole_drive: bool,
    ) -> Result<Self, GraphError> {
        options.validate().map_err(|reason| GraphError::Option { name: "graph", reason })?;
        let mut window = FixedLag::unbounded(solver)?;
        let groups = ClassGroups::new(window.graph_mut());
        Ok(Self {
            options: *options,
            coupling,
            whole_drive,
            window,
            first: 0,
            cameras: VecDeque::new(),
            all_fixed: true,
            vehicles: BTreeMap::new(),
            groups,
            counted: Vec::new(),
            variance_factors: Vec::new(),
            places: (PlaceEdges::default(), LoopOptions::default()),
        })
    }

    /// Edges of places seen again, to stand in the graph of a drive with all others.
    #[must_use]
    pub fn with_places(mut self, edges: PlaceEdges, options: &LoopOptions) -> Self {
        self.places = (edges, *options);
        self
    }

    /// True when no vehicle changes a camera pose.
    pub fn cameras_are_held(&self) -> bool {
        self.coupling == CameraCoupling::Held
    }

    /// The estimated camera of a row of the run; `None` outside the window.
    pub fn camera(&self, row: usize) -> Option<Pose<World, Camera>> {
        let id = self.cameras.get(row.checked_sub(self.first)?)?;
        self.window.graph().values().get::<Isometry3<f64>>(*id).ok().map(|p| Pose::new(*p))
    }

    /// The graph.
    pub fn graph(&self) -> &motorcade_graph::Graph {
        self.window.graph()
    }

    /// Pose nodes in the order of their numbers in `graph.g2o`.
    pub fn nodes(&self) -> Vec<(Node, VariableId)> {
        let cameras = self.cameras.iter().enumerate();
        let cameras = cameras.map(|(k, id)| (Node::Camera { frame: self.first + k }, *id));
        let of_vehicle = |(id, nodes): (&usize, &VehicleNodes)| {
            let (id, rows) = (*id, nodes.poses.by_row());
            rows.into_iter().map(move |(frame, node)| (Node::Vehicle { id, frame }, node))
        };
        let mut nodes: Vec<_> = cameras.chain(self.vehicles.iter().flat_map(of_vehicle)).collect();
        nodes.sort_by_key(|(_, id)| *id);
        nodes
    }

    /// Factors on the covariances of each class of camera–vehicle edges.
    pub fn variance_factors(&self) -> &[VarianceFactor] {
        &self.variance_factors
    }

    /// Estimates a window. Frames of `ego` and of the vehicles' states count from the first frame of the window. A drive has all its
    /// frames and states written back, a sliding window the newest.
    ///
    /// # Errors
    /// A graph that cannot be solved, or times that are not those of `ego`. The trajectories then stay as they were, and the
    /// graph must be made anew.
    pub fn update(
        &mut self,
        frames: &WindowFrames<'_>,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
    ) -> Result<Report, GraphError> {
        self.update_unless(frames, ego, vehicles, Stop::NEVER)
    }

    /// As [`update`](Self::update), given up when asked to.
    ///
    /// # Errors
    /// As [`update`](Self::update); [`GraphError::Stopped`], and the estimates are as before.
    pub fn update_unless(
        &mut self,
        frames: &WindowFrames<'_>,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
        stop: Stop<'_>,
    ) -> Result<Report, GraphError> {
        let (expected, found) = (ego.frames.len(), frames.times_s.len());
        if expected != found {
            return Err(GraphError::Size { what: "times of a window", expected, found });
        }
        let times = FrameTimes::new(frames.times_s, self.options.advanced.reference_interval_s);
        let weight = scale_weight(times.mean_interval(), &self.options);
        self.move_to(frames.first, ego)?;
        self.retire_ended(vehicles)?;
        self.window.remove_measurements();
        self.retire_changed(vehicles)?;
        let cameras: Vec<VariableId> = self.cameras.iter().copied().collect();
        if self.cameras_are_held() {
            for (id, frame) in cameras.iter().zip(&ego.frames) {
                self.window.graph_mut().values_mut().set(*id, *frame.world_from_camera.isometry())?;
            }
        }
        let options = self.options;
        let context = EdgeContext {
            ego,
            times,
            cameras: &cameras,
            options: &options,
            coupling: self.coupling,
            scale_weight: weight,
        };
        let nodes = self.add_edges(vehicles, &context)?;
        let report = self.solve(times.mean_interval(), stop)?;
        self.write_back(ego, vehicles, (&cameras, &nodes), (weight, times), stop)?;
        Ok(report)
    }

    /// Moves the window on to begin at row `first` and end with the frames of `ego`.
    fn move_to(&mut self, first: usize, ego: &EgoTrajectory) -> Result<(), GraphError> {
        if self.cameras.is_empty() {
            self.first = first;
        }
        while self.first < first && !self.cameras.is_empty() {
            self.cameras.pop_front();
            for vehicle in self.vehicles.values_mut() {
                if let PoseNodes::Moving(nodes) = &mut vehicle.poses {
                    nodes.remove(&self.first);
                }
            }
            self.first += 1;
            self.window.retire_oldest()?;
        }
        for (k, frame) in ego.frames.iter().enumerate().skip(self.cameras.len()) {
            let graph = self.window.graph_mut();
            let id = graph.add_variable(*frame.world_from_camera.isometry());
            let is_first = self.first + k == 0 || self.cameras.is_empty();
            self.all_fixed &= is_first || edges::step_is_held(frame, self.coupling, &self.options);
            if self.all_fixed {
                graph.fix(id)?;
            }
            self.cameras.push_back(id);
            self.window.advance(vec![id])?;
        }
        Ok(())
    }

    /// Adds all edges of the window; returns the nodes of each vehicle's states.
    fn add_edges(
        &mut self,
        vehicles: &[VehicleTrajectory],
        context: &EdgeContext<'_>,
    ) -> Result<Vec<Vec<VariableId>>, GraphError> {
        self.counted.clear();
        for edge in edges::of_cameras(context)? {
            self.window.graph_mut().add_boxed(edge.factor)?;
        }
        let (places, options) = &self.places;
        let node = |frame: usize| context.cameras.get(frame).copied();
        for edge in &places.map {
            if let Some(camera) = node(edge.frame) {
                let factor = edge.factor(camera, self.window.graph_mut(), options)?;
                self.window.graph_mut().add_factor(factor)?;
            }
        }
        for edge in &places.loops {
            if let (Some(later), Some(earlier)) = (node(edge.later), node(edge.earlier)) {
                self.window.graph_mut().add_factor(edge.factor(later, earlier, options)?)?;
            }
        }
        let mut all = Vec::with_capacity(vehicles.len());
        for vehicle in vehicles {
            let starts = start::poses(vehicle, context.ego, &context.times, context.options);
            let (nodes, scales) = self.vehicle_nodes(vehicle, &starts);
            // The measurements of a static vehicle count as one: their residuals do not show their noise.
            let counts = !edges::is_static(vehicle, context.options);
            for edge in
                edges::of_vehicle(vehicle, &TrackNodes { nodes: &nodes, starts: &starts, scales }, context)?
            {
                let graph = self.window.graph_mut();
                let id = graph.add_boxed(edge.factor)?;
                let Some(class) = edge.class else { continue };
                if let Some(group) = self.groups.of(class) {
                    graph.assign(id, group)?;
                    self.counted.extend(counts.then_some((id, class)));
                }
            }
            all.push(nodes);
        }
        Ok(all)
    }

    /// The node of each state, new ones where there are none yet, and the scales of the vehicle.
    fn vehicle_nodes(
        &mut self,
        vehicle: &VehicleTrajectory,
        starts: &[Pose<World, motorcade_geometry::Vehicle>],
    ) -> (Vec<VariableId>, Option<TrackScales>) {
        let Self { window, vehicles, first, options, .. } = self;
        let (Some(state), Some(start)) = (vehicle.states.first(), starts.first()) else {
            return (Vec::new(), None);
        };
        let known = vehicles.entry(vehicle.id).or_insert_with(|| {
            let poses = if edges::is_static(vehicle, options) {
                PoseNodes::Static(*first + state.frame, window.graph_mut().add_variable(*start.isometry()))
            } else {
                PoseNodes::Moving(BTreeMap::new())
            };
            VehicleNodes { poses, scales: None }
        });
        let mut nodes = Vec::with_capacity(vehicle.states.len());
        for (state, start) in vehicle.states.iter().zip(starts) {
            nodes.push(match &mut known.poses {
                PoseNodes::Static(_, id) => *id,
                PoseNodes::Moving(rows) => *rows.entry(*first + state.frame).or_insert_with(|| {
                    let id = window.graph_mut().add_variable(*start.isometry());
                    window.assign(state.frame, id);
                    id
                }),
            });
        }
        if edges::shares_size(options) {
            let graph = window.graph_mut();
            known
                .scales
                .get_or_insert_with(|| TrackScales::add(graph, vehicle))
                .complete(window.graph_mut(), vehicle);
        }
        (nodes, known.scales)
    }

    fn solve(&mut self, mean_interval_s: f64, stop: Stop<'_>) -> Result<Report, GraphError> {
        let mut report = self.optimise(stop)?;
        let re_estimated = self.whole_drive && !self.options.constant_weights;
        for _ in 0..if re_estimated { self.options.advanced.variance_rounds } else { 0 } {
            let (graph, groups) = (self.window.graph_mut(), &self.groups);
            let before = groups.factors(graph);
            self.variance_factors =
                variance::estimate(graph, &self.counted, groups, mean_interval_s, &self.options, stop)?;
            if groups.factors(graph) == before {
                break;
            }
            report = self.optimise(stop)?;
        }
        Ok(report)
    }

    fn optimise(&mut self, stop: Stop<'_>) -> Result<Report, GraphError> {
        let report = self.window.optimise_unless(stop)?;
        if self.whole_drive {
            // Covariances are next, with a factor of their own.
            self.window.forget_solve();
        }
        if report.termination == Termination::Cancelled { Err(GraphError::Stopped) } else { Ok(report) }
    }

    fn write_back(
        &self,
        ego: &mut EgoTrajectory,
        vehicles: &mut [VehicleTrajectory],
        (cameras, nodes): (&[VariableId], &[Vec<VariableId>]),
        (weight, times): (f64, FrameTimes<'_>),
        stop: Stop<'_>,
    ) -> Result<(), GraphError> {
        let from = if self.whole_drive { 0 } else { ego.frames.len().saturating_sub(1) };
        let scales = |vehicle: &VehicleTrajectory| self.vehicles.get(&vehicle.id).and_then(|v| v.scales);
        // Variables whose joint covariance the covariance of a state in the world needs.
        let sets = vehicles.iter().zip(nodes).flat_map(|(vehicle, nodes)| {
            let scales: Vec<VariableId> = scales(vehicle).iter().flat_map(TrackScales::nodes).collect();
            let states = vehicle.states.iter().zip(nodes).filter(move |(state, _)| state.frame >= from);
            states.map(move |(state, node)| [&[cameras[state.frame], *node], scales.as_slice()].concat())
        });
        let marginals = Marginals::of_sets(self.window.graph(), sets, stop)?;
        let solution = Solution { graph: self.window.graph(), marginals: &marginals, cameras };
        solution.write_cameras(from, ego)?;
        for (vehicle, nodes) in vehicles.iter_mut().zip(nodes) {
            let scales = scales(vehicle);
            let weighted: Vec<_> = scales.iter().flat_map(|scales| scales.weighted(weight)).collect();
            let written = solution.write_states(from, vehicle, nodes, &weighted, ego)?;
            solution.write_speeds(from, vehicle, nodes, times)?;
            if let Some(scales) = scales.filter(|_| written) {
                solution.write_size(vehicle, scales.size, weight)?;
            }
        }
        Ok(())
    }

    /// Marginalises vehicles that are no longer followed.
    fn retire_ended(&mut self, vehicles: &[VehicleTrajectory]) -> Result<(), GraphError> {
        let followed = |id: &usize| vehicles.iter().any(|v| v.id == *id);
        let ended: Vec<usize> = self.vehicles.keys().copied().filter(|id| !followed(id)).collect();
        ended.into_iter().try_for_each(|id| self.retire_vehicle(id))
    }

    /// Vehicles that changed between static and moving, or were reversed, start anew; nodes before the first state of a vehicle
    /// leave. The measurements of the window must have been removed.
    fn retire_changed(&mut self, vehicles: &[VehicleTrajectory]) -> Result<(), GraphError> {
        for vehicle in vehicles {
            let Some(known) = self.vehicles.get_mut(&vehicle.id) else { continue };
            let same_kind = known.poses.is_static() == edges::is_static(vehicle, &self.options);
            let most_rad = self.options.advanced.flipped_rad;
            if !same_kind || known.poses.is_flipped(self.window.graph(), self.first, vehicle, most_rad) {
                self.retire_vehicle(vehicle.id)?;
                continue;
            }
            let begin = vehicle.states.first().map_or(0, |s| self.first + s.frame);
            if let PoseNodes::Moving(nodes) = &mut known.poses {
                let reached = nodes.split_off(&begin);
                let left: Vec<VariableId> = std::mem::replace(nodes, reached).into_values().collect();
                self.window.retire(&left)?;
            }
        }
        Ok(())
    }

    fn retire_vehicle(&mut self, id: usize) -> Result<(), GraphError> {
        let variables = self.vehicles.remove(&id).map_or_else(Vec::new, |known| known.variables());
        self.window.retire(&variables)
    }
}
