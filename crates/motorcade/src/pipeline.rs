//! The whole way from frames to trajectories.

use motorcade_dataset::Sequence;
use motorcade_geometry::PinholeCamera;
use motorcade_multibody::{MultibodyGraph, WindowFrames};
use motorcade_odometry::{EgoFrame, EgoTrajectory};
use motorcade_perception::{Detection, Perception};
use motorcade_shape::ShapePrior;
use motorcade_vehicles::{
    ExternalTrack, GroundFrame, Track, VehicleTrajectory, estimate_track, track_vehicles,
};

use crate::config::Config;
use crate::error::Result;
use crate::front_end::FrontEnd;
use crate::given_vehicles::{ExternalVehiclePose, external_tracks};
use crate::keypoints::{KeypointTable, KeypointViews};
use crate::motion_source::ExternalTrajectory;
use crate::progress::Progress;
use crate::result::{FrameInfo, RunResult, summary_warnings};
use crate::{scale_source, standing_unit};

/// What files give in place of stages.
#[derive(Clone, Debug, Default)]
pub struct External {
    /// In place of odometry.
    pub trajectory: Option<ExternalTrajectory>,
    /// In place of our vehicle localisation.
    pub vehicles: Option<Vec<ExternalVehiclePose>>,
    /// Keypoints for our vehicle localisation.
    pub keypoints: Option<KeypointTable>,
    /// Shape prior in place of our own for keypoints of its number.
    pub shape_prior: Option<ShapePrior>,
}

/// Runs everything on a sequence. `threads` ≥ 2 lets perception work ahead on threads of its own; results do not depend on it.
///
/// # Errors
/// Perception that fails as such (a network that does not run). A frame that does not read is bridged, not an error.
pub fn run(
    sequence: &Sequence,
    perception: &Perception,
    given: &External,
    height_m: f64,
    config: &Config,
    threads: usize,
    progress: &dyn Progress,
) -> Result<RunResult> {
    let front_end = FrontEnd::pass(sequence, perception, given, config, threads, progress, &mut |_| ())?;
    Ok(estimate_drive(front_end, given, height_m, config, threads, progress))
}

/// From what the frames left to trajectories: metres, tracks, vehicles, the graph.
pub fn estimate_drive(
    front_end: FrontEnd,
    given: &External,
    height_m: f64,
    config: &Config,
    threads: usize,
    progress: &dyn Progress,
) -> RunResult {
    let FrontEnd { camera, frames, detections, mut stopwatch, mut warnings, mut metric, .. } = front_end;
    let (motion, measurements) = (front_end.motion, front_end.road_measurements);
    let mut ego =
        stopwatch.time("scale", || scale_source::ego(&motion, &measurements, height_m, metric, config));
    progress.begin("vehicles", None);
    let seen = Seen { camera: &camera, frames: &frames, detections: &detections, given, config };
    let mut vehicles = stopwatch.time("vehicles", || seen.follow(&ego));
    let unknown = given.trajectory.as_ref().filter(|_| !metric && measurements.is_empty());
    if let Some(trajectory) = unknown {
        let mut found = None;
        // Twice: with the unit known boxes are linked better.
        for _ in 0..2 {
            let Some(unit) = standing_unit::of(&vehicles, &trajectory.world_from_camera) else { break };
            let mut motion = trajectory.metric(unit.metres).up_to_scale();
            motion.frames.truncate(frames.len());
            ego = EgoTrajectory::metric_within(&motion, &measurements, height_m, unit.sigma);
            vehicles = stopwatch.time("vehicles", || seen.follow(&ego));
            found = Some(unit);
        }
        if let Some(unit) = found {
            metric = true;
            progress.warn(&unit.to_string());
            warnings.push(unit.to_string());
        }
    }
    progress.begin("graph", None);
    let solved = stopwatch.time("graph", || solve_graph(&mut ego, &mut vehicles, &frames, config, threads));
    let (graph, graph_report) = solved.unwrap_or_else(|error| {
        let warning = format!("the multi-object graph was not solved ({error}); front-end estimates stand");
        progress.warn(&warning);
        warnings.push(warning);
        (None, None)
    });
    let mut result = RunResult {
        camera,
        frames,
        ego,
        road_measurements: measurements,
        vehicles,
        graph,
        graph_report,
        detections,
        looked_for_vehicles: front_end.looked_for_vehicles,
        stopwatch,
        warnings,
        interrupted: front_end.interrupted,
    };
    for warning in summary_warnings(&result, metric) {
        progress.warn(&warning);
        result.warnings.push(warning);
    }
    result
}

/// What vehicles are found from.
struct Seen<'a> {
    camera: &'a PinholeCamera,
    frames: &'a [FrameInfo],
    detections: &'a [Vec<Detection>],
    given: &'a External,
    config: &'a Config,
}

impl Seen<'_> {
    /// Vehicles, each for itself, as seen from a camera that goes this way.
    fn follow(&self, ego: &EgoTrajectory) -> Vec<VehicleTrajectory> {
        let Self { camera, frames, detections, given, config } = *self;
        let start_ns = frames.first().map_or(0, |f| f.timestamp_ns);
        let grounds = grounds(ego, frames, start_ns);
        let numbers: Vec<u64> = frames.iter().map(|f| f.number).collect();
        let tracks: Vec<(Track, ExternalTrack)> = match &given.vehicles {
            Some(poses) => external_tracks(poses, &numbers, &grounds, detections, camera),
            None => {
                let tracks = track_vehicles(camera, &grounds, detections, &config.tracker);
                with_keypoints(tracks, given, &numbers, camera, &grounds)
            }
        };
        let side = config.vehicles.traffic_side;
        let estimate =
            |(track, given): &(Track, ExternalTrack)| estimate_track(camera, &grounds, track, given, side);
        tracks.iter().filter_map(estimate).collect()
    }
}

/// Tracks with what their keypoints say of them.
pub(crate) fn with_keypoints(
    tracks: Vec<Track>,
    given: &External,
    numbers: &[u64],
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
) -> Vec<(Track, ExternalTrack)> {
    let table = given.keypoints.as_ref();
    let keypoints = table.map(|table| KeypointViews::new(table, given, numbers, camera, grounds));
    let of = |t: &Track| keypoints.as_ref().map_or_else(ExternalTrack::default, |k| k.of(t));
    tracks.into_iter().map(|t| (of(&t), t)).map(|(given, t)| (t, given)).collect()
}

type Solved = (Option<MultibodyGraph>, Option<motorcade_graph::Report>);

fn solve_graph(
    ego: &mut EgoTrajectory,
    vehicles: &mut [VehicleTrajectory],
    frames: &[FrameInfo],
    config: &Config,
    threads: usize,
) -> std::result::Result<Solved, motorcade_graph::GraphError> {
    if !config.graph.enabled || ego.frames.is_empty() {
        return Ok((None, None));
    }
    let mut graph = MultibodyGraph::drive(&config.graph, threads)?;
    let times_s = times_s(&frames[..ego.frames.len().min(frames.len())]);
    let report = graph.update(&WindowFrames { first: 0, times_s: &times_s }, ego, vehicles)?;
    Ok((Some(graph), Some(report)))
}

/// Times of frames \[s\], from the first.
pub(crate) fn times_s(frames: &[FrameInfo]) -> Vec<f64> {
    let start_ns = frames.first().map_or(0, |f| f.timestamp_ns);
    frames.iter().map(|f| (f.timestamp_ns - start_ns) as f64 * 1e-9).collect()
}

/// Camera and road of each frame; times count from `start_ns`.
pub(crate) fn grounds(ego: &EgoTrajectory, frames: &[FrameInfo], start_ns: i64) -> Vec<GroundFrame> {
    let one = |(e, f): (&EgoFrame, &FrameInfo)| GroundFrame {
        world_from_camera: e.world_from_camera,
        up: e.road_normal,
        height_m: ego.height_m,
        pitch_sigma_rad: e.road_tilt_covariance[(0, 0)].max(0.0).sqrt(),
        time_s: (f.timestamp_ns - start_ns) as f64 * 1e-9,
    };
    ego.frames.iter().zip(frames).map(one).collect()
}
