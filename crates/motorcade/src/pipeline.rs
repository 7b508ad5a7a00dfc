//! The whole way from frames to trajectories.

use std::sync::mpsc::sync_channel;

use motorcade_dataset::{BadFrame, Frame, Sequence};
use motorcade_geometry::PinholeCamera;
use motorcade_odometry::{
    EgoFrame, EgoTrajectory, FrameStatus, Odometry, Rectangle, RoadMeasurement, StaticMask,
};
use motorcade_perception::{Detection, Perception, Percepts};
use motorcade_vehicles::{GivenView, GroundFrame, Track, VehicleTrajectory, estimate_track, track_vehicles};

use crate::config::{Config, VehicleMask};
use crate::error::{Error, Result};
use crate::given_vehicles::{GivenPose, given_tracks};
use crate::motion_source::{GivenTrajectory, MotionSource};
use crate::multibody::Multibody;
use crate::progress::Progress;
use crate::scale_source::ScaleSource;
use crate::timing::Stopwatch;

/// A frame of the input as the run saw it.
#[derive(Clone, Debug)]
pub struct FrameInfo {
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// Why it could not be read, when it could not.
    pub problem: Option<String>,
}

/// What a run found.
pub struct RunResult {
    /// Intrinsics of the (undistorted) frames.
    pub camera: PinholeCamera,
    /// Frames, in order.
    pub frames: Vec<FrameInfo>,
    /// The camera's trajectory and the road.
    pub ego: EgoTrajectory,
    /// Road measurements the scale came from.
    pub road_measurements: Vec<RoadMeasurement>,
    /// Vehicles.
    pub vehicles: Vec<VehicleTrajectory>,
    /// The multi-object graph, solved.
    pub graph: Option<Multibody>,
    /// How its solution went.
    pub graph_report: Option<motorcade_graph::Report>,
    /// Detections handed in by perception, frame by frame.
    pub detections: Vec<Vec<Detection>>,
    /// False when nobody looked for vehicles.
    pub looked_for_vehicles: bool,
    /// Times.
    pub stopwatch: Stopwatch,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// True when it was stopped before the last frame.
    pub interrupted: bool,
}

impl RunResult {
    /// Share of frames whose pose was tracked (or stood). Frames of the first second that were filled in from the map that
    /// began after them do not count against it.
    pub fn tracked_share(&self) -> f64 {
        const FIRST_SECOND: usize = 10;
        let good = |s: FrameStatus| matches!(s, FrameStatus::Tracked | FrameStatus::Standstill);
        let counted =
            |(k, f): &(usize, &EgoFrame)| *k >= FIRST_SECOND || f.status != FrameStatus::Initialising;
        let (mut tracked, mut all) = (0_usize, 0_usize);
        for (_, frame) in self.ego.frames.iter().enumerate().filter(counted) {
            all += 1;
            tracked += usize::from(good(frame.status));
        }
        // A run that never got a map has tracked nothing.
        if tracked == 0 { 0.0 } else { tracked as f64 / all as f64 }
    }
}

/// One frame on its way from perception to odometry.
type Perceived = (std::result::Result<Frame, BadFrame>, Percepts, f64);

/// Runs everything on a sequence. `threads` ≥ 2 lets perception work ahead on threads of its own; results do not depend on it.
///
/// # Errors
/// Perception that fails as such (a network that does not run). A frame that does not read is bridged, not an error.
pub fn run(
    sequence: &Sequence,
    perception: &Perception,
    given: &Given,
    height_m: f64,
    config: &Config,
    threads: usize,
    progress: &dyn Progress,
) -> Result<RunResult> {
    let mut drive = Drive::new(sequence.camera()?, given, config);
    drive.looked_for_vehicles = perception.looks_for_vehicles() || given.vehicles.is_some();
    progress.begin("odometry", Some(sequence.len()));
    let mut interrupted = false;
    let mut take = |perceived: Result<Perceived>| -> Result<bool> {
        drive.step(perceived?, config, progress);
        progress.advance(drive.frames.len());
        interrupted = progress.cancelled();
        Ok(!interrupted)
    };
    if threads < 2 {
        for frame in sequence.frames() {
            if !take(perceive(perception, frame))? {
                break;
            }
        }
    } else {
        std::thread::scope(|scope| -> Result<()> {
            let (sender, receiver) = sync_channel(4);
            scope.spawn(move || {
                for frame in sequence.frames() {
                    // The receiver has gone: the run was stopped.
                    if sender.send(perceive(perception, frame)).is_err() {
                        break;
                    }
                }
            });
            for perceived in receiver {
                if !take(perceived)? {
                    break;
                }
            }
            Ok(())
        })?;
    }
    Ok(drive.finish(given, height_m, config, progress, interrupted, threads))
}

/// A run without any pixel: frames by number and time, detections and a metric camera trajectory from files.
pub struct PixelFree {
    /// Intrinsics.
    pub camera: PinholeCamera,
    /// Frames.
    pub frames: Vec<FrameInfo>,
    /// Detections of each frame.
    pub detections: Vec<Vec<Detection>>,
}

/// Runs tracking, vehicles and graph where no frames are: `given` must hold a metric trajectory.
///
/// # Errors
/// A trajectory that is missing, not metric or of another length.
pub fn run_without_frames(
    input: PixelFree,
    given: &Given,
    height_m: f64,
    config: &Config,
    threads: usize,
    progress: &dyn Progress,
) -> Result<RunResult> {
    let fits = |t: &GivenTrajectory| t.metric && t.world_from_camera.len() == input.frames.len();
    if !given.trajectory.as_ref().is_some_and(fits) {
        let text = "without frames the camera trajectory must be given, in metres (--trajectory-scale metric), a pose a frame";
        return Err(Error::Config(text.to_owned()));
    }
    let mut drive = Drive::new(input.camera, given, config);
    drive.looked_for_vehicles = true;
    (drive.frames, drive.detections) = (input.frames, input.detections);
    Ok(drive.finish(given, height_m, config, progress, false, threads))
}

/// What files give in place of stages.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// In place of odometry.
    pub trajectory: Option<GivenTrajectory>,
    /// In place of our vehicle localisation.
    pub vehicles: Option<Vec<GivenPose>>,
}

fn perceive(perception: &Perception, frame: std::result::Result<Frame, BadFrame>) -> Result<Perceived> {
    let start = std::time::Instant::now();
    let percepts = match &frame {
        Ok(frame) => perception.perceive(frame)?,
        Err(_) => Percepts::default(),
    };
    Ok((frame, percepts, start.elapsed().as_secs_f64() * 1e3))
}

/// State of a run between frames.
struct Drive {
    camera: PinholeCamera,
    motion: MotionSource,
    scale: ScaleSource,
    frames: Vec<FrameInfo>,
    detections: Vec<Vec<Detection>>,
    stopwatch: Stopwatch,
    warnings: Vec<String>,
    looked_for_vehicles: bool,
}

impl Drive {
    fn new(camera: PinholeCamera, given: &Given, config: &Config) -> Self {
        let motion = match &given.trajectory {
            Some(trajectory) => MotionSource::Given(trajectory.up_to_scale()),
            None => MotionSource::Own(Box::new(Odometry::new(
                camera,
                motorcade_odometry::OdometryOptions { seed: config.run.seed, ..config.odometry },
            ))),
        };
        Self {
            camera,
            motion,
            scale: ScaleSource::new(camera, config),
            frames: Vec::new(),
            detections: Vec::new(),
            stopwatch: Stopwatch::default(),
            warnings: Vec::new(),
            looked_for_vehicles: false,
        }
    }

    /// One frame: perception's boxes mask the scene, the camera moves, the road is measured.
    fn step(
        &mut self,
        (frame, percepts, perception_ms): Perceived,
        config: &Config,
        progress: &dyn Progress,
    ) {
        let frame = match frame {
            Ok(frame) => frame,
            Err(bad) => {
                self.motion.skip();
                self.detections.push(Vec::new());
                let message = format!("{bad}; its pose is bridged");
                progress.warn(&message);
                self.warnings.push(message);
                let problem = Some(bad.reason.to_string());
                self.frames.push(FrameInfo { number: bad.number, timestamp_ns: bad.timestamp_ns, problem });
                return;
            }
        };
        self.stopwatch.add("perception", perception_ms);
        let index = self.frames.len();
        let boxes: Vec<Rectangle> =
            percepts.detections.iter().filter(|d| d.score >= MASKING_SCORE).map(rectangle).collect();
        let masked: &[Rectangle] = if config.run.vehicle_mask == VehicleMask::All { &boxes } else { &[] };
        let mask = StaticMask { boxes: masked, ignore: frame.ignore.as_ref() };
        let gray = frame.gray();
        let pyramid = self.stopwatch.time("odometry", || self.motion.process(&gray, &mask));
        let so_far = self.motion.so_far();
        // Vehicles hide the road whether they move or not.
        let hidden = StaticMask { boxes: &boxes, ignore: frame.ignore.as_ref() };
        let road = percepts.road.as_ref();
        let usable = |p: &nalgebra::Point2<f64>| hidden.allows(p) && road.is_none_or(|r| r.is_road(p.x, p.y));
        let (scale, segment) = (&mut self.scale, so_far.frames[index].segment);
        self.stopwatch
            .time("road", || scale.process(index, segment, &pyramid, so_far, road.is_some(), usable));
        self.frames.push(FrameInfo { number: frame.number, timestamp_ns: frame.timestamp_ns, problem: None });
        self.detections.push(percepts.detections);
    }

    fn finish(
        mut self,
        given: &Given,
        height_m: f64,
        config: &Config,
        progress: &dyn Progress,
        interrupted: bool,
        threads: usize,
    ) -> RunResult {
        let road_measurements = self.scale.measurements().to_vec();
        let up_to_scale = self.motion.finish(self.frames.len());
        let metric = given.trajectory.as_ref().is_some_and(|t| t.metric);
        let scale = &self.scale;
        let ego = self.stopwatch.time("scale", || scale.ego(&up_to_scale, height_m, metric));
        let grounds = grounds(&ego, &self.frames);
        progress.begin("vehicles", None);
        let numbers: Vec<u64> = self.frames.iter().map(|f| f.number).collect();
        let tracks: Vec<(Track, Vec<GivenView>)> =
            self.stopwatch.time("tracking", || match &given.vehicles {
                Some(poses) => given_tracks(poses, &numbers, &grounds, &self.detections, &self.camera),
                None => {
                    let tracks = track_vehicles(&self.camera, &grounds, &self.detections, &config.tracker);
                    tracks.into_iter().map(|t| (t, Vec::new())).collect()
                }
            });
        let side = config.vehicles.traffic_side;
        let estimate = |(track, views): &(Track, Vec<GivenView>)| {
            estimate_track(&self.camera, &grounds, track, views, side)
        };
        let mut vehicles: Vec<VehicleTrajectory> =
            self.stopwatch.time("vehicles", || tracks.iter().filter_map(estimate).collect());
        progress.begin("graph", None);
        let mut ego = ego;
        let solved = self.stopwatch.time("graph", || solve_graph(&mut ego, &mut vehicles, config, threads));
        let (graph, graph_report) = match solved {
            Ok(solved) => solved,
            Err(error) => {
                let warning =
                    format!("the multi-object graph was not solved ({error}); front-end estimates stand");
                progress.warn(&warning);
                self.warnings.push(warning);
                (None, None)
            }
        };
        let mut result = RunResult {
            camera: self.camera,
            frames: self.frames,
            ego,
            road_measurements,
            vehicles,
            graph,
            graph_report,
            detections: self.detections,
            looked_for_vehicles: self.looked_for_vehicles,
            stopwatch: self.stopwatch,
            warnings: self.warnings,
            interrupted,
        };
        for warning in summary_warnings(&result) {
            progress.warn(&warning);
            result.warnings.push(warning);
        }
        result
    }
}

type Solved = (Option<Multibody>, Option<motorcade_graph::Report>);

fn solve_graph(
    ego: &mut EgoTrajectory,
    vehicles: &mut [VehicleTrajectory],
    config: &Config,
    threads: usize,
) -> std::result::Result<Solved, motorcade_graph::GraphError> {
    if !config.graph.enabled || ego.frames.is_empty() {
        return Ok((None, None));
    }
    let mut graph = Multibody::new(ego, vehicles, &config.graph)?;
    let report = graph.solve(ego, vehicles, &config.graph, threads)?;
    Ok((Some(graph), Some(report)))
}

/// A box less certain than this masks nothing: it is more often a shadow than a vehicle.
const MASKING_SCORE: f64 = 0.3;

fn rectangle(detection: &Detection) -> Rectangle {
    let b = &detection.bbox;
    Rectangle { x1: b.x1, y1: b.y1, x2: b.x2, y2: b.y2 }
}

fn grounds(ego: &EgoTrajectory, frames: &[FrameInfo]) -> Vec<GroundFrame> {
    let start = frames.first().map_or(0, |f| f.timestamp_ns);
    let one = |(e, f): (&EgoFrame, &FrameInfo)| GroundFrame {
        world_from_camera: e.world_from_camera,
        up: e.road_normal,
        height_m: ego.height_m,
        pitch_sigma_rad: e.road_tilt_covariance[(0, 0)].max(0.0).sqrt(),
        time_s: (f.timestamp_ns - start) as f64 * 1e-9,
    };
    ego.frames.iter().zip(frames).map(one).collect()
}

fn summary_warnings(result: &RunResult) -> Vec<String> {
    let mut out = Vec::new();
    let n = result.ego.frames.len();
    let tracked = |f: &&EgoFrame| matches!(f.status, FrameStatus::Tracked | FrameStatus::Standstill);
    let untracked = n - result.ego.frames.iter().filter(tracked).count();
    if untracked > 0 {
        out.push(format!(
            "{untracked} of {n} frames have a bridged or filled-in pose (see `status` in frames.csv)"
        ));
    }
    if result.road_measurements.is_empty() && n > 0 {
        out.push(
            "the road was never seen: the metric scale is a guess, lengths may be off by a factor of two"
                .to_owned(),
        );
    }
    if !result.looked_for_vehicles {
        out.push("no vehicles were looked for: give --models or --detections".to_owned());
    }
    out
}
