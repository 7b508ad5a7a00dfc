//! The run as it would go in the car: every frame's camera and vehicles told when that frame has come, from it and the
//! frames before it alone.
//!
//! Scale and road are smoothed over the last seconds; boxes, sizes and motion of the vehicles are estimated over a window of
//! frames; and the window is optimised as one graph, what left it being kept as a prior ([`MultibodyGraph`]). A frame costs
//! the same from start to end of a drive.

mod newest;

use std::collections::BTreeMap;
use std::time::Instant;

use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use motorcade_multibody::{MultibodyGraph, WindowFrames};
use motorcade_odometry::{EgoFrame, EgoTrajectory, RoadMeasurement, Uncertainty};
use motorcade_vehicles::{ExternalTrack, GroundFrame, Track, Tracker, VehicleTrajectory, estimate_track};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::front_end::{FrontEnd, FrontEndView};
use crate::given_vehicles::external_tracks;
use crate::pipeline::{External, grounds, times_s, with_keypoints};
use crate::progress::Progress;
use crate::result::{FrameInfo, RunResult, summary_warnings};
use crate::scale_source;
use crate::timing::Stopwatch;
pub use newest::OnlineEstimate;

/// Windows of an online run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineOptions {
    /// False waits for the last frame and takes the drive as a whole.
    pub enabled: bool,
    /// Frames of camera and vehicles that are estimated together.
    pub lag_frames: usize,
    /// Frames over which scale and road are smoothed, at least as many.
    pub scale_frames: usize,
    /// Iterations of the graph a frame, at most: it starts where the frame before ended.
    pub iterations: usize,
}

impl Default for OnlineOptions {
    fn default() -> Self {
        // 2.5 s: the time in which a vehicle shows whether it moves. 15 s: errors of scale last for several seconds.
        Self { enabled: false, lag_frames: 25, scale_frames: 150, iterations: 8 }
    }
}

/// An online run.
pub struct Online<'a> {
    camera: PinholeCamera,
    given: &'a External,
    height_m: f64,
    config: &'a Config,
    tracker: Tracker,
    /// Made with the first frame, and anew after one that was not solved.
    graph: Option<MultibodyGraph>,
    /// Where the first frame of the next window is, by the windows so far.
    anchor: Pose<World, Camera>,
    /// What is known of the pose at the first frame of the long window.
    entry: Uncertainty,
    /// The last scale and road measured; stands in when the window holds none, after minutes at a light.
    remembered: Option<Remembered>,
    ego: Vec<EgoFrame>,
    vehicles: BTreeMap<usize, VehicleTrajectory>,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
}

#[derive(Clone, Copy)]
struct Remembered {
    segment: usize,
    measurement: RoadMeasurement,
}

/// The last frames, numbered from 0.
struct Window {
    /// Row of the run of its first frame.
    first: usize,
    ego: EgoTrajectory,
    grounds: Vec<GroundFrame>,
}

impl<'a> Online<'a> {
    /// Ready for the first frame.
    pub fn new(camera: PinholeCamera, given: &'a External, height_m: f64, config: &'a Config) -> Self {
        Self {
            camera,
            given,
            height_m,
            config,
            tracker: Tracker::new(camera, config.tracker),
            graph: None,
            anchor: Pose::identity(),
            entry: Uncertainty::default(),
            remembered: None,
            ego: Vec::new(),
            vehicles: BTreeMap::new(),
            stopwatch: Stopwatch::default(),
            warnings: Vec::new(),
        }
    }

    /// Takes the newest frame; says where camera and vehicles are in it.
    pub fn advance<'n>(&'n mut self, so_far: &FrontEndView<'n>) -> OnlineEstimate<'n> {
        let newest = so_far.frames.len() - 1;
        let mut clock = Instant::now();
        let mut lap = || std::mem::replace(&mut clock, Instant::now()).elapsed().as_secs_f64() * 1e3;
        let mut window = self.window(so_far);
        self.stopwatch.add("scale", lap());
        let mut vehicles = self.vehicles(so_far, &window);
        self.stopwatch.add("vehicles", lap());
        if self.config.graph.enabled {
            let frames = &so_far.frames[window.first..];
            self.solve(&mut window, frames, &mut vehicles);
        }
        self.stopwatch.add("graph", lap());
        self.ego.extend(window.ego.frames.pop());
        let mut seen = Vec::new();
        for vehicle in vehicles {
            seen.extend(self.keep(vehicle, window.first, newest));
        }
        OnlineEstimate {
            frame: &so_far.frames[newest],
            ego: &self.ego[newest],
            before: newest.checked_sub(1).map(|b| (&so_far.frames[b], &self.ego[b])),
            vehicles: seen.iter().filter_map(|id| self.vehicles.get(id)).collect(),
        }
    }

    /// Ends the run; every frame and vehicle as it was told.
    pub fn finish(self, front_end: FrontEnd, progress: &dyn Progress) -> RunResult {
        let mut stopwatch = front_end.stopwatch;
        stopwatch.join(&self.stopwatch);
        let ego = EgoTrajectory { frames: self.ego, height_m: self.height_m, noise: Vec::new() };
        let mut result = RunResult {
            camera: front_end.camera,
            frames: front_end.frames,
            ego,
            road_measurements: front_end.road_measurements,
            vehicles: self.vehicles.into_values().collect(),
            graph: None,
            graph_report: None,
            detections: front_end.detections,
            looked_for_vehicles: front_end.looked_for_vehicles,
            stopwatch,
            warnings: front_end.warnings,
            interrupted: front_end.interrupted,
        };
        result.warnings.extend(self.warnings);
        for warning in summary_warnings(&result, front_end.metric) {
            progress.warn(&warning);
            result.warnings.push(warning);
        }
        result
    }

    /// Metres and road of the last frames, in the world of the graph.
    fn window(&mut self, so_far: &FrontEndView<'_>) -> Window {
        let (frames, options) = (so_far.frames.len(), &self.config.online);
        let lag = options.lag_frames.min(frames);
        let longest = options.scale_frames.max(lag);
        let long = longest.min(frames);
        let first = frames - long;
        let motion = so_far.motion.window(first..frames);
        // In order of frames: those that lie in the window are the last.
        let from = so_far.road_measurements.partition_point(|m| m.frame < first);
        let mut measured: Vec<RoadMeasurement> = so_far.road_measurements[from..]
            .iter()
            .filter(|m| m.reference >= first)
            .map(|m| RoadMeasurement { frame: m.frame - first, reference: m.reference - first, ..*m })
            .collect();
        let segment = so_far.motion.frames[frames - 1].segment;
        if measured.is_empty() {
            measured.extend(self.remembered.filter(|r| r.segment == segment).map(|r| r.measurement));
        }
        let metric = self.given.trajectory.as_ref().is_some_and(|t| t.metric);
        let mut ego = scale_source::ego(&motion, &measured, self.height_m, metric, self.config);
        self.remember(segment, ego.frames.last());
        self.carry_uncertainty(&mut ego, first, long == longest);
        ego.frames.drain(..long - lag);
        let first = frames - lag;
        self.place(&mut ego, first);
        if let Some(second) = ego.frames.get(1).filter(|_| lag == options.lag_frames) {
            self.anchor = second.world_from_camera;
        }
        let start_ns = so_far.frames[0].timestamp_ns;
        let grounds = grounds(&ego, &so_far.frames[first..], start_ns);
        Window { first, ego, grounds }
    }

    /// Puts into each frame what is known of its pose in the world: what was known where the window begins, row `first`, and
    /// the window's own steps. With `leaves` that frame is not in the next window.
    fn carry_uncertainty(&mut self, ego: &mut EgoTrajectory, first: usize, leaves: bool) {
        let mut uncertainty = self.entry.clone();
        for k in 0..ego.frames.len() {
            let covariance = if k == 0 && first > 0 {
                uncertainty.covariance()
            } else {
                let before = ego.frames[k.saturating_sub(1)].world_from_camera;
                let step = (before.inverse() * ego.frames[k].world_from_camera).cast();
                uncertainty.advance(&ego.frames[k], &step)
            };
            ego.frames[k].covariance = covariance;
            if leaves && k == 1 {
                self.entry = uncertainty.clone();
            }
        }
    }

    fn remember(&mut self, segment: usize, newest: Option<&EgoFrame>) {
        let Some(frame) = newest.filter(|f| f.scale_measured) else { return };
        let up = frame.road_normal;
        let value =
            Vector3::new((frame.scale / self.height_m).ln(), (up.z / up.y).atan(), (up.x / up.y).atan());
        let mut covariance = frame.road_tilt_covariance;
        // Pitch and roll stand in the upper left there.
        covariance = nalgebra::Matrix3::new(
            frame.scale_sigma.powi(2),
            0.0,
            0.0,
            0.0,
            covariance[(0, 0)],
            covariance[(0, 1)],
            0.0,
            covariance[(1, 0)],
            covariance[(1, 1)],
        );
        let measurement = RoadMeasurement {
            frame: 0,
            reference: 0,
            value,
            baseline: 1.0,
            covariance,
            curvature: None,
            agreement: 1.0,
            pixels: 0,
        };
        self.remembered = Some(Remembered { segment, measurement });
    }

    /// Moves a window to where its first frame is in the world.
    fn place(&self, ego: &mut EgoTrajectory, first: usize) {
        let Some(begin) = ego.frames.first().map(|f| f.world_from_camera) else { return };
        let free = self.graph.as_ref().filter(|graph| !graph.cameras_are_held());
        let known = free.and_then(|graph| graph.camera(first)).unwrap_or(self.anchor);
        let world_from_window: Pose<World, World> = (known * begin.inverse()).cast();
        for frame in &mut ego.frames {
            let placed: Pose<World, Camera> = world_from_window * frame.world_from_camera;
            frame.world_from_camera = placed;
        }
    }

    /// Vehicles of the window; frames count from its first.
    fn vehicles(&mut self, so_far: &FrontEndView<'_>, window: &Window) -> Vec<VehicleTrajectory> {
        let (newest, first) = (so_far.frames.len() - 1, window.first);
        let Some(ground) = window.grounds.last() else { return Vec::new() };
        if self.given.vehicles.is_none() {
            let ground_of = |row: usize| window.grounds.get(row.checked_sub(first)?).copied();
            self.tracker.advance(newest, ground, &so_far.detections[newest], ground_of);
        }
        let numbers: Vec<u64> = so_far.frames[first..].iter().map(|f| f.number).collect();
        let (camera, grounds) = (&self.camera, &window.grounds);
        let tracks: Vec<(Track, ExternalTrack)> = match &self.given.vehicles {
            Some(poses) => external_tracks(poses, &numbers, grounds, &so_far.detections[first..], camera),
            None => {
                let mut tracks = self.tracker.present(first);
                tracks.iter_mut().flat_map(|t| &mut t.boxes).for_each(|b| b.frame -= first);
                with_keypoints(tracks, self.given, &numbers, camera, grounds)
            }
        };
        let side = self.config.vehicles.traffic_side;
        let estimate =
            |(track, given): &(Track, ExternalTrack)| estimate_track(camera, grounds, track, given, side);
        tracks.iter().filter_map(estimate).collect()
    }

    /// Optimises the window. A graph that cannot be solved is begun anew from where the camera stands.
    fn solve(&mut self, window: &mut Window, frames: &[FrameInfo], vehicles: &mut [VehicleTrajectory]) {
        let times_s = times_s(frames);
        let frames = WindowFrames { first: window.first, times_s: &times_s };
        let (graph, iterations) = (self.graph.take(), self.config.online.iterations);
        let graph = graph.map_or_else(|| MultibodyGraph::sliding(&self.config.graph, iterations), Ok);
        let solved = graph.and_then(|mut graph| {
            graph.update(&frames, &mut window.ego, vehicles)?;
            self.graph = Some(graph);
            Ok(())
        });
        if let Err(error) = solved {
            let number = self.ego.len();
            self.warnings.push(format!(
                "row {number}: the window of the multi-object graph was not solved ({error}); front-end estimates stand"
            ));
        }
    }

    /// Adds the newest state of a vehicle to what was told of it; its identity when it was seen in the newest frame.
    fn keep(&mut self, window: VehicleTrajectory, first: usize, newest: usize) -> Option<usize> {
        let VehicleTrajectory { id, class, size, size_covariance, p_moving, states } = window;
        let mut state = states.into_iter().next_back().filter(|s| s.frame + first == newest)?;
        state.frame = newest;
        let empty = || VehicleTrajectory { id, class, size, size_covariance, p_moving, states: Vec::new() };
        let kept = self.vehicles.entry(id).or_insert_with(empty);
        (kept.class, kept.size, kept.size_covariance, kept.p_moving) =
            (class, size, size_covariance, p_moving);
        kept.states.push(state);
        Some(id)
    }
}
