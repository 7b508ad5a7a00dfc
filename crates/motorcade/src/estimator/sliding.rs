//! The estimator over the last seconds: camera and vehicles of every frame, from it and the frames before it alone.
//!
//! Scale and road are smoothed over the longer window of [`OnlineOptions`]; boxes, sizes and motion of vehicles are estimated
//! over the shorter one, which is optimised as one graph; frames that leave it become a prior ([`MultibodyGraph`]). A
//! frame costs the same from start to end of a drive.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Instant;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_multibody::{MultibodyGraph, WindowFrames};
use motorcade_odometry::{EgoFrame, EgoTrajectory, RoadMeasurement, RoadState, Uncertainty};
use motorcade_vehicles::{GroundFrame, Tracker, VehicleTrajectory};

use super::unit::{Unit, UnitEstimator};
use super::vehicles::{VehicleInput, estimate_vehicles, ground_frames, times_s};
use crate::assembly::Estimated;
use crate::estimate::{Estimate, VehicleEstimate};
use crate::progress::Progress;
use crate::record::{FrontEndRecord, FrontEndView};
use crate::result::RunResult;
use crate::scale_source;
use crate::settings::Settings;
use crate::timing::Stopwatch;

/// The estimator over the last seconds.
pub struct SlidingEstimator {
    tracker: Tracker,
    graph: Option<MultibodyGraph>,
    /// Pose of the first frame of the next window, by the windows so far.
    anchor: Pose<World, Camera>,
    /// Uncertainty of the pose at the first frame of the long window.
    entry: Uncertainty,
    /// The last scale and road measured; stands in when the window holds none, after minutes at a light.
    remembered: Option<Remembered>,
    units: UnitEstimator,
    /// Unit of an external trajectory of unknown scale.
    unit: Option<Unit>,
    /// Camera of every frame as it was estimated when the frame came.
    ego: Vec<EgoFrame>,
    /// Vehicles by identity, every state as it was estimated when its frame came.
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

impl SlidingEstimator {
    /// Ready for the first frame.
    pub fn new(settings: &Settings) -> Self {
        Self {
            tracker: Tracker::new(settings.camera, settings.config.tracker, &settings.config.vehicles),
            graph: None,
            anchor: Pose::identity(),
            entry: Uncertainty::default(),
            remembered: None,
            units: UnitEstimator::new(settings.config.scale.unit),
            unit: None,
            ego: Vec::new(),
            vehicles: BTreeMap::new(),
            stopwatch: Stopwatch::default(),
            warnings: Vec::new(),
        }
    }

    /// Frames taken so far.
    pub fn len(&self) -> usize {
        self.ego.len()
    }

    /// True before the first frame.
    pub fn is_empty(&self) -> bool {
        self.ego.is_empty()
    }

    /// Takes the newest frame of a view: frames are taken one by one, each with all before it.
    pub fn advance(&mut self, view: &FrontEndView<'_>, settings: &Settings) {
        let newest = view.frames.len() - 1;
        let mut clock = Instant::now();
        let mut lap = || std::mem::replace(&mut clock, Instant::now()).elapsed().as_secs_f64() * 1e3;
        let mut window = self.window(view, settings);
        self.stopwatch.add("scale", lap());
        let mut vehicles = self.vehicles_of(view, &window, settings);
        self.estimate_unit(view, &window, &vehicles, settings);
        self.stopwatch.add("vehicles", lap());
        if settings.config.graph.enabled {
            self.solve(view, &mut window, &mut vehicles, settings);
        }
        self.stopwatch.add("graph", lap());
        self.ego.extend(window.ego.frames.pop());
        for vehicle in vehicles {
            self.keep(vehicle, window.first, newest);
        }
    }

    /// The estimate of the newest frame taken; `None` before the first.
    pub fn newest(&self, view: &FrontEndView<'_>) -> Option<Estimate> {
        let row = self.ego.len().checked_sub(1)?;
        let (ego, frame) = (self.ego.get(row)?, view.frames.get(row)?);
        let speed_mps = row.checked_sub(1).map_or(0.0, |before| {
            let step = ego.world_from_camera.translation() - self.ego[before].world_from_camera.translation();
            let seconds = (frame.timestamp_ns - view.frames[before].timestamp_ns) as f64 * 1e-9;
            if seconds > 0.0 { step.norm() / seconds } else { 0.0 }
        });
        let newest = |v: &VehicleTrajectory| {
            let state = v.states.last().filter(|s| s.frame == row)?.clone();
            let VehicleTrajectory { id, class, size, size_covariance, p_moving, .. } = *v;
            Some(VehicleEstimate { id, class, size, size_covariance, p_moving, state })
        };
        let vehicles = self.vehicles.values().filter_map(newest).collect();
        Some(Estimate { frame: frame.clone(), ego: ego.clone(), speed_mps, vehicles })
    }

    /// Ends the drive: every frame and vehicle as it was estimated when it came.
    pub fn finish(
        self,
        mut record: FrontEndRecord,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> RunResult {
        record.stopwatch.join(&self.stopwatch);
        let warnings = self.warnings.into_iter().chain(self.unit.iter().map(Unit::to_string)).collect();
        let estimated = Estimated {
            camera: settings.camera,
            ego: EgoTrajectory { frames: self.ego, height_m: settings.height_m, noise: Vec::new() },
            vehicles: self.vehicles.into_values().collect(),
            graph: None,
            warnings,
            metric: settings.metric() || self.unit.is_some(),
        };
        RunResult::new(record, estimated, progress)
    }

    /// Metres and road of the last frames, in the world of the graph.
    fn window(&mut self, view: &FrontEndView<'_>, settings: &Settings) -> Window {
        let (frames, options) = (view.frames.len(), &settings.config.online);
        let lag = options.lag_frames.min(frames);
        let longest = options.scale_frames.max(lag);
        let long = longest.min(frames);
        let first = frames - long;
        let motion = view.motion.window(first..frames);
        // In order of frames: those that lie in the window are the last.
        let from = view.road_measurements.partition_point(|m| m.frame < first);
        let mut measured: Vec<RoadMeasurement> = view.road_measurements[from..]
            .iter()
            .filter(|m| m.reference >= first)
            .map(|m| RoadMeasurement { frame: m.frame - first, reference: m.reference - first, ..*m })
            .collect();
        let segment = view.motion.frames[frames - 1].segment;
        if measured.is_empty() {
            measured.extend(self.remembered.filter(|r| r.segment == segment).map(|r| r.measurement));
        }
        let mut ego = match self.external_in_metres(first..frames, view, settings) {
            Some(ego) => ego,
            None => {
                scale_source::ego(&motion, &measured, settings.height_m, settings.metric(), &settings.config)
            }
        };
        self.remember(segment, ego.frames.last(), settings.height_m);
        self.carry_uncertainty(&mut ego, first, long == longest);
        ego.frames.drain(..long - lag);
        let first = frames - lag;
        self.place(&mut ego, first);
        if let Some(second) = ego.frames.get(1).filter(|_| lag == options.lag_frames) {
            self.anchor = second.world_from_camera;
        }
        let start_ns = view.frames[0].timestamp_ns;
        let grounds = ground_frames(&ego, &view.frames[first..], start_ns);
        Window { first, ego, grounds }
    }

    /// Metric trajectory of an external one whose unit vehicles gave, where no road was seen.
    fn external_in_metres(
        &self,
        rows: Range<usize>,
        view: &FrontEndView<'_>,
        settings: &Settings,
    ) -> Option<EgoTrajectory> {
        let (trajectory, unit) = (settings.external.trajectory.as_ref()?, self.unit?);
        let timestamps_ns: Vec<i64> = view.frames[rows.clone()].iter().map(|f| f.timestamp_ns).collect();
        let motion = trajectory.in_metres(unit.metres, rows, &timestamps_ns);
        let unseen = view.road_measurements.is_empty();
        let advanced = &settings.config.scale.advanced;
        unseen.then(|| EgoTrajectory::metric(&motion, &[], settings.height_m, unit.sigma, advanced))
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

    fn remember(&mut self, segment: usize, newest: Option<&EgoFrame>, height_m: f64) {
        let Some(frame) = newest.filter(|f| f.scale_measured) else { return };
        let up = frame.road_normal;
        let state = RoadState {
            log_inverse_height: (frame.scale / height_m).ln(),
            pitch_rad: (up.z / up.y).atan(),
            roll_rad: (up.x / up.y).atan(),
        };
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
            state,
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
    fn vehicles_of(
        &mut self,
        view: &FrontEndView<'_>,
        window: &Window,
        settings: &Settings,
    ) -> Vec<VehicleTrajectory> {
        let (newest, first, grounds) = (view.frames.len() - 1, window.first, &window.grounds);
        let Some(ground) = grounds.last() else { return Vec::new() };
        let tracker = &mut self.tracker;
        let track = || {
            let ground_of = |row: usize| grounds.get(row.checked_sub(first)?).copied();
            tracker.advance(newest, ground, &view.detections[newest], ground_of);
            let mut tracks = tracker.present(first);
            tracks.iter_mut().flat_map(|t| &mut t.boxes).for_each(|b| b.frame -= first);
            tracks
        };
        let input = VehicleInput {
            frames: &view.frames[first..],
            detections: &view.detections[first..],
            keypoints: &view.keypoints[first..],
            grounds,
        };
        estimate_vehicles(&input, settings, track)
    }

    /// The unit of an external trajectory of unknown scale, where no road was seen; from the next frame on.
    fn estimate_unit(
        &mut self,
        view: &FrontEndView<'_>,
        window: &Window,
        vehicles: &[VehicleTrajectory],
        settings: &Settings,
    ) {
        let Some(trajectory) = settings.external.trajectory.as_ref().filter(|t| !t.metric) else { return };
        if view.road_measurements.is_empty() {
            let poses = trajectory.world_from_camera.get(window.first..view.frames.len());
            self.units.update(vehicles, poses.unwrap_or_default());
            self.unit = self.units.unit();
        }
    }

    /// Optimises the window. A graph that cannot be solved is begun anew from where the camera stands.
    fn solve(
        &mut self,
        view: &FrontEndView<'_>,
        window: &mut Window,
        vehicles: &mut [VehicleTrajectory],
        settings: &Settings,
    ) {
        let times_s = times_s(&view.frames[window.first..]);
        let frames = WindowFrames { first: window.first, times_s: &times_s };
        let (options, iterations) = (&settings.config.graph, settings.config.online.iterations);
        let graph = self.graph.take().map_or_else(|| MultibodyGraph::sliding(options, iterations), Ok);
        let solved = graph.and_then(|mut graph| {
            graph.update(&frames, &mut window.ego, vehicles)?;
            self.graph = Some(graph);
            Ok(())
        });
        if let Err(error) = solved {
            let row = self.ego.len();
            self.warnings.push(format!(
                "row {row}: the window of the multi-object graph was not solved ({error}); front-end estimates stand"
            ));
        }
    }

    /// Adds the newest state of a vehicle to its trajectory, when it was seen in the newest frame.
    fn keep(&mut self, window: VehicleTrajectory, first: usize, newest: usize) {
        let VehicleTrajectory { id, class, size, size_covariance, p_moving, states } = window;
        let Some(mut state) = states.into_iter().next_back().filter(|s| s.frame + first == newest) else {
            return;
        };
        state.frame = newest;
        let empty = || VehicleTrajectory { id, class, size, size_covariance, p_moving, states: Vec::new() };
        let kept = self.vehicles.entry(id).or_insert_with(empty);
        (kept.class, kept.size, kept.size_covariance, kept.p_moving) =
            (class, size, size_covariance, p_moving);
        kept.states.push(state);
    }
}
