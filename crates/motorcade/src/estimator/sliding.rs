//! The estimator over the last seconds: camera and vehicles of every frame, from it and the frames before it alone.
//!
//! Scale and road are smoothed over the longer window of [`OnlineOptions`]; boxes, sizes and motion of vehicles are estimated
//! over the shorter one, which is optimised as one graph; frames that leave it become a prior ([`MultibodyGraph`]). A
//! frame costs the same from start to end of a drive. Windows are times: where frames come faster than
//! [`OnlineOptions::interval_s`], only some are estimated in full ("estimated rows"), those between are predicted from the last.

mod results;
mod state;
mod undecided;
mod window;

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Instant;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_multibody::{MultibodyGraph, WindowFrames};
use motorcade_odometry::{EgoFrame, EgoTrajectory, RoadMeasurement, Uncertainty};
use motorcade_vehicles::{KeypointFitters, KeypointTrack, Tracker, VehicleTrajectory};

use super::ego_archive::EgoArchive;
use super::online_loops::OnlineLoops;
use super::prediction;
use super::remembered::Remembered;
use super::unit::{Unit, UnitEstimator};
use super::vehicle_archive::VehicleArchive;
use super::vehicles::{
    KnownKeypoints, VehicleInput, estimate_vehicles, ground_frames, keypoint_fitters, times_s,
};
use crate::record::{FrameInfo, FrontEndView, mean_interval_s};
use crate::relative::add_camera;
use crate::revision::Revision;
use crate::scale_source;
use crate::settings::Settings;
use crate::timing::Stopwatch;
pub(crate) use state::SlidingState;
use undecided::Undecided;
use window::Window;

/// Slack for times rounded to milliseconds \[s\].
const ROUNDING_S: f64 = 1e-3;
/// Frames of a window at least, however slowly they come: as many as a steady motion is recognised by.
const LEAST_FRAMES: usize = 3;

/// The estimator over the last seconds.
pub struct SlidingEstimator {
    tracker: Tracker,
    graph: Option<MultibodyGraph>,
    /// Rows of the run that were estimated in full.
    estimated: Vec<usize>,
    /// Poses of the last window; the next begins at one of them.
    placed: Placed,
    /// Uncertainty of the pose at each row of the last long window, and its first row.
    entries: (usize, VecDeque<Uncertainty>),
    /// The last scale and road measured; stands in when the window holds none, after minutes at a light.
    remembered: Option<Remembered>,
    fitters: KeypointFitters,
    /// Keypoints of the tracks in the window, by identity.
    keypoints: BTreeMap<usize, KeypointTrack>,
    units: UnitEstimator,
    /// Unit of an external trajectory of unknown scale.
    unit: Option<Unit>,
    /// Camera of every frame as it was estimated when the frame came.
    ego: EgoArchive,
    /// Vehicles by identity, every state as it was estimated when its frame came.
    vehicles: BTreeMap<usize, VehicleTrajectory>,
    /// Their states that no later estimate needs.
    archive: VehicleArchive,
    /// Speed of the camera in every frame \[m/s\], by poses that share a scale.
    speeds_mps: Vec<f64>,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
    /// Places seen again; poses above stay in the world before their corrections.
    loops: Option<OnlineLoops>,
    /// Corrections that nobody took yet.
    revisions: Vec<Revision>,
}

/// Poses of a window before its graph.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Placed {
    /// Place of the first among the estimated rows.
    first: usize,
    poses: Vec<Pose<World, Camera>>,
}

impl SlidingEstimator {
    /// Ready for the first frame.
    pub fn new(settings: &Settings) -> Self {
        Self {
            tracker: Tracker::new(settings.camera, settings.config.tracker, &settings.config.vehicles),
            graph: None,
            estimated: Vec::new(),
            placed: Placed::default(),
            entries: (0, VecDeque::new()),
            remembered: None,
            fitters: keypoint_fitters(settings),
            keypoints: BTreeMap::new(),
            units: UnitEstimator::new(settings.config.scale.advanced.unit),
            unit: None,
            ego: EgoArchive::default(),
            vehicles: BTreeMap::new(),
            archive: VehicleArchive::default(),
            speeds_mps: Vec::new(),
            stopwatch: Stopwatch::default(),
            warnings: Vec::new(),
            loops: OnlineLoops::new(settings),
            revisions: Vec::new(),
        }
    }

    /// Corrections since the last call.
    pub fn take_revisions(&mut self) -> Vec<Revision> {
        std::mem::take(&mut self.revisions)
    }

    /// Number of keyframes of places whose features are not needed any more.
    pub(crate) fn places_done(&self, settings: &Settings) -> usize {
        self.loops.as_ref().map_or(0, |loops| loops.done(settings))
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
        self.advance_window(view, settings);
        if let (Some(loops), Some(newest)) = (&mut self.loops, self.ego.newest()) {
            self.revisions.extend(self.stopwatch.time("loops", || loops.advance(view, newest, settings)));
        }
    }

    fn advance_window(&mut self, view: &FrontEndView<'_>, settings: &Settings) {
        let mut clock = Instant::now();
        let mut lap = || std::mem::replace(&mut clock, Instant::now()).elapsed().as_secs_f64() * 1e3;
        if let Some(camera) = self.between(view, settings) {
            self.predict(view, camera, settings);
            self.stopwatch.add("vehicles", lap());
            return;
        }
        self.estimated.push(view.frames.len() - 1);
        let mut window = self.window(view, settings);
        self.stopwatch.add("scale", lap());
        let mut vehicles = self.vehicles_of(view, &window, settings);
        self.estimate_unit(view, &window, &vehicles, settings);
        self.stopwatch.add("vehicles", lap());
        self.solve(&mut window, &mut vehicles, settings);
        self.stopwatch.add("graph", lap());
        self.speeds_mps.push(window.speed_mps());
        window.ego.frames.pop().into_iter().for_each(|frame| self.ego.push(frame));
        for vehicle in vehicles {
            self.keep(vehicle, &window.rows);
        }
    }

    /// The predicted camera of a newest frame that need not be estimated in full: the last one that was is recent, and
    /// odometry leads on from there.
    fn between(&self, view: &FrontEndView<'_>, settings: &Settings) -> Option<EgoFrame> {
        let (base, newest) = (*self.estimated.last()?, view.frames.len() - 1);
        let elapsed_s = seconds(view, base, newest);
        let external = &settings.external;
        let own = external.trajectory.is_none() && external.vehicles.is_none();
        if !own || elapsed_s > settings.config.online.interval_s - ROUNDING_S {
            return None;
        }
        prediction::camera(view, base, self.ego.get(base)?)
    }

    /// Takes a frame between two estimated ones: boxes are linked to tracks; vehicles that are seen go on as they moved.
    fn predict(&mut self, view: &FrontEndView<'_>, camera: EgoFrame, settings: &Settings) {
        let newest = view.frames.len() - 1;
        let start_ns = view.frames[0].timestamp_ns;
        let ego = EgoTrajectory { frames: vec![camera], height_m: settings.height_m, noise: Vec::new() };
        let grounds = ground_frames(&ego, &view.frames[newest..], start_ns, settings);
        let _ended = self.tracker.advance(newest, &grounds[0], &view.detections[newest], |_| None);
        for track in self.tracker.present(newest) {
            let (Some(vehicle), Some(seen)) = (self.vehicles.get_mut(&track.id), track.boxes.last()) else {
                continue;
            };
            let recent = vehicle.states.last().filter(|s| s.frame + 1 == newest);
            let Some(state) = recent else { continue };
            let elapsed_s = seconds(view, state.frame, newest);
            let seen = (seen.observed.bbox, seen.score);
            let next = prediction::vehicle(state, newest, elapsed_s, seen, &settings.config.online);
            vehicle.states.push(next);
        }
        self.speeds_mps.push(self.predicted_speed_mps(view, &ego.frames[0]));
        ego.frames.into_iter().for_each(|frame| self.ego.push(frame));
    }

    /// Speed over the way since the last frame that was estimated in full: frames after it have its scale.
    fn predicted_speed_mps(&self, view: &FrontEndView<'_>, camera: &EgoFrame) -> f64 {
        let Some(before) = self.ego.newest() else { return 0.0 };
        let newest = view.frames.len() - 1;
        let step = camera.world_from_camera.translation() - before.world_from_camera.translation();
        window::speed_mps(step.norm(), seconds(view, newest - 1, newest))
    }

    /// Moves older estimates out of memory; returns the first row that later estimates need.
    pub fn put_away(&mut self, view: &FrontEndView<'_>, settings: &Settings) -> usize {
        let options = &settings.config.online;
        let needed_s = options.scale_s.max(options.lag_s) + options.advanced.forget_after_s;
        let newest = view.frames.len().saturating_sub(1);
        let recent = self.estimated.len().saturating_sub(LEAST_FRAMES);
        let oldest = self.estimated.get(recent).copied().unwrap_or(newest);
        let old =
            |f: &FrameInfo| (view.frames[newest].timestamp_ns - f.timestamp_ns) as f64 * 1e-9 > needed_s;
        let row = view.frames.partition_point(old).min(oldest);
        self.ego.put_away_before(row);
        // States come back without their measurements, which the results of online runs do not have.
        self.archive.put_away_before(if options.enabled { row } else { 0 }, &mut self.vehicles);
        row
    }

    /// Metres and road of the last frames, in the world of the graph.
    fn window(&mut self, view: &FrontEndView<'_>, settings: &Settings) -> Window {
        let (frames, options) = (view.frames.len(), &settings.config.online);
        let newest = frames - 1;
        let older = |row: usize, age_s: f64| seconds(view, row, newest) > age_s - ROUNDING_S;
        let recent = self.estimated.partition_point(|row| older(*row, options.lag_s));
        let from = recent.min(self.estimated.len().saturating_sub(LEAST_FRAMES));
        let rows: Vec<usize> = self.estimated[from..].to_vec();
        let times = &view.frames[..rows[0]];
        let newest_ns = view.frames[newest].timestamp_ns;
        let age_s = |f: &FrameInfo| (newest_ns - f.timestamp_ns) as f64 * 1e-9;
        let first = times.partition_point(|f| age_s(f) > options.scale_s - ROUNDING_S);
        let motion = view.motion.window(first..frames);
        // In order of frames: those that lie in the window are the last.
        let since = view.road_measurements.partition_point(|m| m.frame < first);
        let mut measured: Vec<RoadMeasurement> = view.road_measurements[since..]
            .iter()
            .filter(|m| m.reference >= first)
            .map(|m| RoadMeasurement { frame: m.frame - first, reference: m.reference - first, ..*m })
            .collect();
        let segment = view.motion.frames[newest].segment;
        if measured.is_empty() {
            measured.extend(self.remembered.filter(|r| r.segment == segment).map(|r| r.measurement()));
        }
        let mut ego = match self.external_in_metres(first..frames, view, settings) {
            Some(ego) => ego,
            None => {
                scale_source::ego(&motion, &measured, settings.height_m, settings.metric(), &settings.config)
            }
        };
        self.remember(segment, &ego, first);
        self.carry_uncertainty(&mut ego, first);
        let in_window: Vec<usize> = rows.iter().map(|row| row - first).collect();
        let mut ego = ego.of_rows(&in_window);
        self.place(&mut ego, from);
        let start_ns = view.frames[0].timestamp_ns;
        let infos: Vec<FrameInfo> = rows.iter().map(|row| view.frames[*row].clone()).collect();
        // The slopes of the road by a longer way than that of the window, which is often no hill.
        let since = self.estimated.partition_point(|row| older(*row, options.scale_s));
        let known = |row: &usize| Some((self.ego.get(*row)?.clone(), view.frames[*row].clone()));
        let before = self.estimated[since.min(from)..from].iter().filter_map(known);
        let (mut driven, mut seen): (Vec<EgoFrame>, Vec<FrameInfo>) = before.unzip();
        let earlier = driven.len();
        driven.extend(ego.frames.iter().cloned());
        seen.extend_from_slice(&infos);
        let driven = EgoTrajectory { frames: driven, height_m: ego.height_m, noise: Vec::new() };
        let grounds = ground_frames(&driven, &seen, start_ns, settings).split_off(earlier);
        Window { first: from, rows, infos, ego, grounds }
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
        let external = &settings.config.odometry.advanced.external;
        let motion = trajectory.in_metres(unit.metres, rows, &timestamps_ns, external);
        let unseen = view.road_measurements.is_empty();
        let advanced = &settings.config.scale.advanced.metric;
        unseen.then(|| EgoTrajectory::metric(&motion, &[], settings.height_m, unit.sigma, advanced))
    }

    /// Puts into each frame what is known of its pose in the world: what was known where the window begins, row `first`, and
    /// the window's own steps.
    fn carry_uncertainty(&mut self, ego: &mut EgoTrajectory, first: usize) {
        let (earlier, known) = &self.entries;
        let entry = first.checked_sub(*earlier).and_then(|k| known.get(k)).cloned();
        let begun = entry.is_some() && first > 0;
        let mut uncertainty = entry.filter(|_| first > 0).unwrap_or_default();
        let mut entries = VecDeque::with_capacity(ego.frames.len());
        for k in 0..ego.frames.len() {
            let covariance = if k == 0 && begun {
                uncertainty.covariance()
            } else {
                let before = ego.frames[k.saturating_sub(1)].world_from_camera;
                let step = (before.inverse() * ego.frames[k].world_from_camera).cast();
                uncertainty.advance(&ego.frames[k], &step)
            };
            ego.frames[k].covariance = covariance;
            entries.push_back(uncertainty.clone());
        }
        self.entries = (first, entries);
    }

    /// Remembers the scale of the newest frame where it was measured; the way since, where it was not.
    fn remember(&mut self, segment: usize, ego: &EgoTrajectory, first: usize) {
        let Some(newest) = ego.frames.last() else { return };
        if newest.scale_measured {
            let drift = ego.noise.iter().flatten().last().map_or(0.0, |noise| noise.drift);
            self.remembered = Some(Remembered::new(segment, newest, ego.height_m, drift));
        } else if let Some(remembered) = &mut self.remembered {
            let before = self.estimated.len().checked_sub(2).map(|k| self.estimated[k].saturating_sub(first));
            let before = before.and_then(|k| ego.frames.get(k)).unwrap_or(newest);
            let way = newest.world_from_camera.translation() - before.world_from_camera.translation();
            remembered.travel(way.norm() / ego.height_m);
        }
    }

    /// Moves a window to where its first frame, `first` among the estimated rows, is in the world.
    fn place(&mut self, ego: &mut EgoTrajectory, first: usize) {
        let Some(begin) = ego.frames.first().map(|f| f.world_from_camera) else { return };
        let free = self.graph.as_ref().filter(|graph| !graph.cameras_are_held());
        let placed = first.checked_sub(self.placed.first).and_then(|k| self.placed.poses.get(k)).copied();
        let known = free.and_then(|graph| graph.camera(first)).or(placed).unwrap_or_default();
        let world_from_window: Pose<World, World> = (known * begin.inverse()).cast();
        for frame in &mut ego.frames {
            let placed: Pose<World, Camera> = world_from_window * frame.world_from_camera;
            frame.world_from_camera = placed;
        }
        self.placed = Placed { first, poses: ego.frames.iter().map(|f| f.world_from_camera).collect() };
    }

    /// Vehicles of the window; frames count from its first.
    fn vehicles_of(
        &mut self,
        view: &FrontEndView<'_>,
        window: &Window,
        settings: &Settings,
    ) -> Vec<VehicleTrajectory> {
        let Window { rows, infos, grounds, .. } = window;
        let (Some(ground), Some(&newest)) = (grounds.last(), rows.last()) else { return Vec::new() };
        let tracker = &mut self.tracker;
        let in_window = |row: usize| rows.binary_search(&row).ok();
        let track = || {
            let ground_of = |row: usize| grounds.get(in_window(row)?).copied();
            tracker.advance(newest, ground, &view.detections[newest], ground_of);
            let mut tracks = tracker.present(rows[0]);
            for track in &mut tracks {
                track.boxes.retain_mut(|b| in_window(b.frame).map(|k| b.frame = k).is_some());
            }
            tracks.retain(|track| !track.boxes.is_empty());
            tracks
        };
        let detections: Vec<_> = rows.iter().map(|row| view.detections[*row].clone()).collect();
        let keypoints: Vec<_> = rows.iter().map(|row| view.keypoints[*row].clone()).collect();
        self.keypoints.retain(|_, known| known.advance(rows[0]));
        let fitters = &self.fitters;
        let input =
            VehicleInput { frames: infos, detections: &detections, keypoints: &keypoints, grounds, fitters };
        // Identities of a window are those of the tracker.
        let known = KnownKeypoints { rows, tracks: &mut self.keypoints };
        estimate_vehicles(&input, settings, Some(known), &|| false, track)
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
            // Beside an external trajectory every row is estimated.
            let poses = trajectory.world_from_camera.get(window.first..view.frames.len());
            self.units.update(vehicles, poses.unwrap_or_default(), mean_interval_s(view.frames));
            self.unit = self.units.unit();
        }
    }

    /// Optimises the window, where it shall be. A graph that cannot be solved is begun anew from where the camera stands.
    fn solve(&mut self, window: &mut Window, vehicles: &mut Vec<VehicleTrajectory>, settings: &Settings) {
        if !settings.config.graph.enabled {
            return add_camera(&window.ego, vehicles);
        }
        let undecided =
            Undecided::out_of(vehicles, &window.ego, &settings.config.vehicles.advanced.kinematic_state);
        let times_s = times_s(&window.infos);
        let frames = WindowFrames { first: window.first, times_s: &times_s };
        let (options, iterations) = (&settings.config.graph, settings.config.online.iterations);
        let graph = self.graph.take().map_or_else(|| MultibodyGraph::sliding(options, iterations), Ok);
        let solved = graph.and_then(|mut graph| {
            graph.update(&frames, &mut window.ego, vehicles)?;
            self.graph = Some(graph);
            Ok(())
        });
        if let Err(error) = solved {
            add_camera(&window.ego, vehicles);
            let row = self.ego.len();
            self.warnings.push(format!(
                "row {row}: the window of the multi-object graph was not solved ({error}); front-end estimates stand"
            ));
        }
        undecided.back_into(vehicles, &window.ego);
    }

    /// Adds the newest state of a vehicle to its trajectory, when it was seen in the newest of the window's `rows`.
    fn keep(&mut self, window: VehicleTrajectory, rows: &[usize]) {
        let VehicleTrajectory { id, class, size, size_covariance, size_by_road, p_moving, states } = window;
        let (Some(mut state), Some(&newest)) = (states.into_iter().next_back(), rows.last()) else { return };
        if state.frame + 1 != rows.len() {
            return;
        }
        state.frame = newest;
        state.include_hypotheses();
        let empty = || VehicleTrajectory {
            id,
            class,
            size,
            size_covariance,
            size_by_road,
            p_moving,
            states: Vec::new(),
        };
        let kept = self.vehicles.entry(id).or_insert_with(empty);
        (kept.class, kept.size, kept.size_covariance) = (class, size, size_covariance);
        (kept.size_by_road, kept.p_moving) = (size_by_road, p_moving);
        kept.states.push(state);
    }
}

/// Time from one row to a later one \[s\].
fn seconds(view: &FrontEndView<'_>, from: usize, to: usize) -> f64 {
    (view.frames[to].timestamp_ns - view.frames[from].timestamp_ns) as f64 * 1e-9
}
