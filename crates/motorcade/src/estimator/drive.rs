//! The estimator over the whole drive.

use motorcade_graph::{GraphError, Report, Stop};
use motorcade_multibody::{MultibodyGraph, WindowFrames};
use motorcade_odometry::{EgoTrajectory, OdometryTrajectory};
use motorcade_vehicles::{
    AdvancedVehicleOptions, VehicleState, VehicleTrajectory, join_met_again, track_both_ways,
};

use super::camera_height::HeightByVehicles;
use super::distances::{self, DistanceFit};
use super::loops;
use super::unit::{self, Unit};
use super::vehicles::{VehicleInput, estimate_vehicles, ground_frames, keypoint_fitters, times_s};
use crate::assembly::Estimated;
use crate::closed_loop::Loops;
use crate::progress::{Progress, stopped_after_frames};
use crate::record::{FrameInfo, FrontEndRecord, mean_interval_s};
use crate::relative::add_camera;
use crate::result::RunResult;
use crate::scale_source;
use crate::settings::Settings;

/// Estimates a drive from all the front end knows of it: metres, vehicles, the multi-object graph.
///
/// # Panics
/// Never: numerical failures leave the estimates of the stage before and are reported as warnings.
pub fn estimate_drive(mut record: FrontEndRecord, settings: &Settings, progress: &dyn Progress) -> RunResult {
    let mut stopwatch = std::mem::take(&mut record.stopwatch);
    let stop = stopped_after_frames(record.interrupted, progress);
    let (mut known, by_vehicles) = stopwatch.time("vehicles", || known_height(&record, settings, &stop));
    let (mut ego, fit) = stopwatch.time("scale", || metric_trajectory(&record, &known));
    known.height_m = ego.height_m;
    // From here on motion is in metres.
    record.motion = OdometryTrajectory::default();
    let mut loops = stopwatch.time("loops", || loops::close(&mut record, &mut ego, &known, &stop));
    let settings = &known;
    progress.begin("vehicles", None);
    let mut vehicles = stopwatch.time("vehicles", || vehicles_of_drive(&record, &ego, settings, &stop));
    let unit =
        stopwatch.time("vehicles", || estimate_unit(&record, settings, &mut ego, &mut vehicles, &stop));
    let vehicles_are_whole = !stop();
    (vehicles, loops.vehicles_met_again) =
        met_again(vehicles, &loops, &record.frames, &settings.config.vehicles.advanced);
    progress.begin("graph", None);
    let solved =
        stopwatch.time("graph", || solve_graph(&record, &mut ego, &mut vehicles, &loops, settings, &stop));
    let mut warnings: Vec<String> = unit.iter().map(Unit::to_string).collect();
    warnings.extend(by_sensor(fit.as_ref(), settings).or(by_vehicles).or_else(|| doubt(&vehicles, settings)));
    warnings.extend(loops.describe());
    if matches!(solved, Err(GraphError::Stopped)) {
        record.end_early();
        warnings.push(if vehicles_are_whole {
            "stopped while the graph was solved".to_owned()
        } else {
            "stopped while vehicles were estimated: some are not there".to_owned()
        });
    }
    let graph = solved.unwrap_or_else(|error| {
        warnings.push(format!("the multi-object graph was not solved ({error}); front-end estimates stand"));
        None
    });
    if graph.is_none() {
        add_camera(&ego, &mut vehicles);
    }
    vehicles.iter_mut().flat_map(|v| &mut v.states).for_each(VehicleState::include_hypotheses);
    record.stopwatch = stopwatch;
    let metric = settings.metric() || unit.is_some() || fit.is_some();
    RunResult::new(
        record,
        Estimated {
            camera: settings.camera,
            ego,
            vehicles,
            graph,
            loops,
            warnings,
            metric,
            speeds_mps: None,
        },
        &settings.config.checks,
        progress,
    )
}

/// Standing vehicles that were passed in several visits of a place as one each, and the number of passes joined.
fn met_again(
    vehicles: Vec<VehicleTrajectory>,
    loops: &Loops,
    frames: &[FrameInfo],
    options: &AdvancedVehicleOptions,
) -> (Vec<VehicleTrajectory>, usize) {
    if loops.closed().next().is_none() {
        return (vehicles, 0);
    }
    let near_frames = (options.met_again.near_loop_s / mean_interval_s(frames)).ceil() as usize;
    join_met_again(vehicles, options, |earlier, later| loops.join(earlier, later, near_frames))
}

/// Settings with the height by vehicles where it is unknown or to be combined with the stated one, and what there is to say of it.
fn known_height(
    record: &FrontEndRecord,
    settings: &Settings,
    stop: &dyn Fn() -> bool,
) -> (Settings, Option<String>) {
    let options = &settings.config.scale.height;
    if !settings.height_unknown && (!options.combined || settings.metric()) {
        return (settings.clone(), None);
    }
    let (mut known, found) = height_by_vehicles(record, settings, stop);
    let bias_sigma = settings.config.scale.advanced.metric.bias_sigma;
    if !settings.height_unknown {
        let Some(found) = found else { return (settings.clone(), None) };
        let stated_m = settings.height_m;
        let by_vehicles = HeightByVehicles { log_factor: (known.height_m / stated_m).ln(), ..found };
        let (log_factor, sigma) = by_vehicles.combined(bias_sigma, options);
        known.height_m = stated_m * log_factor.exp();
        known.config.scale.advanced.metric.bias_sigma = sigma;
        let words = by_vehicles.disagreement(stated_m, options).unwrap_or_else(|| {
            let (height_m, sigma_m, cars) = (known.height_m, known.height_m * sigma, plural(found.vehicles));
            format!("height of the camera as stated and by {cars}: {height_m:.2} ± {sigma_m:.2} m")
        });
        return (known, Some(words));
    }
    let sigma = found.map_or(options.guess_sigma, |height| height.sigma);
    known.config.scale.advanced.metric.bias_sigma = bias_sigma.hypot(sigma);
    let (height_m, sigma_m) = (known.height_m, known.height_m * sigma);
    let words = match found {
        Some(HeightByVehicles { vehicles, .. }) => {
            let (cars, guess) = (
                plural(vehicles),
                if vehicles < options.advanced.least_vehicles { " and a guess" } else { "" },
            );
            format!("height of the camera by the size of {cars}{guess}: {height_m:.2} ± {sigma_m:.2} m")
        }
        None => format!(
            "height of the camera guessed, {height_m:.2} ± {sigma_m:.2} m: no car tells it; give it with --height"
        ),
    };
    (known, Some(words))
}

fn plural(cars: usize) -> String {
    if cars == 1 { "1 car".to_owned() } else { format!("{cars} cars") }
}

/// Settings with the height by vehicles, from the given one on, and the estimate of the last round; `None` where there are none.
fn height_by_vehicles(
    record: &FrontEndRecord,
    settings: &Settings,
    stop: &dyn Fn() -> bool,
) -> (Settings, Option<HeightByVehicles>) {
    let classes = &settings.config.vehicles.advanced.class;
    let mut known = settings.clone();
    let mut found = None;
    for _ in 0..settings.config.scale.height.advanced.rounds {
        let ego = by_road(record, &known);
        let vehicles = vehicles_of_drive(record, &ego, &known, stop);
        let height = HeightByVehicles::new(&vehicles, known.height_m, &settings.config.scale.height, classes);
        let Some(mut height) = height else { break };
        if settings.height_unknown {
            height = height.with_guess(known.height_m, &settings.config.scale.height);
        }
        (known.height_m, _) = height.metres(known.height_m);
        found = Some(height);
    }
    (known, found)
}

/// A warning where vehicles contradict the stated height.
fn doubt(vehicles: &[VehicleTrajectory], settings: &Settings) -> Option<String> {
    if settings.metric() {
        return None;
    }
    let options = &settings.config.scale.height;
    let classes = &settings.config.vehicles.advanced.class;
    HeightByVehicles::new(vehicles, settings.height_m, options, classes)?
        .disagreement(settings.height_m, options)
}

/// What there is to say of the distances of another sensor.
fn by_sensor(fit: Option<&DistanceFit>, settings: &Settings) -> Option<String> {
    let given = settings.external.distances.as_ref()?;
    let unused = || {
        format!(
            "no distance of the {} lies in frames whose motion was measured: they were not used",
            given.sensor
        )
    };
    Some(fit.map_or_else(unused, |fit| fit.describe(&settings.config.scale.distances)))
}

/// The trajectory in metres, and what distances of another sensor had to do with it.
fn metric_trajectory(record: &FrontEndRecord, settings: &Settings) -> (EgoTrajectory, Option<DistanceFit>) {
    let Settings { height_m, config, external, .. } = settings;
    let with =
        |distances| distances::ego(&record.motion, &record.road_measurements, *height_m, distances, config);
    let helped = external.distances.as_ref().and_then(with);
    helped.map_or_else(|| (by_road(record, settings), None), |(ego, fit)| (ego, Some(fit)))
}

fn by_road(record: &FrontEndRecord, settings: &Settings) -> EgoTrajectory {
    let Settings { height_m, config, .. } = settings;
    scale_source::ego(&record.motion, &record.road_measurements, *height_m, settings.metric(), config)
}

/// Vehicles as seen from this camera trajectory.
fn vehicles_of_drive(
    record: &FrontEndRecord,
    ego: &EgoTrajectory,
    settings: &Settings,
    stop: &dyn Fn() -> bool,
) -> Vec<VehicleTrajectory> {
    let FrontEndRecord { frames, detections, keypoints, .. } = record;
    let start_ns = frames.first().map_or(0, |f| f.timestamp_ns);
    let grounds = ground_frames(ego, frames, start_ns, settings);
    let fitters = keypoint_fitters(settings);
    let input = VehicleInput {
        frames,
        detections: detections.kept(),
        keypoints: keypoints.kept(),
        grounds: &grounds,
        fitters: &fitters,
    };
    let track = || {
        let (tracker, vehicles) = (&settings.config.tracker, &settings.config.vehicles);
        track_both_ways(&settings.camera, &grounds, detections.kept(), tracker, vehicles, stop)
    };
    estimate_vehicles(&input, settings, None, stop, track)
}

/// The unit of an external trajectory of unknown scale, where no road was seen; camera and vehicles then follow it.
fn estimate_unit(
    record: &FrontEndRecord,
    settings: &Settings,
    ego: &mut EgoTrajectory,
    vehicles: &mut Vec<VehicleTrajectory>,
    stop: &dyn Fn() -> bool,
) -> Option<Unit> {
    let trajectory = settings.external.trajectory.as_ref();
    let trajectory = trajectory.filter(|t| !t.metric && record.road_measurements.is_empty())?;
    let mut found = None;
    // Twice: with the unit known boxes are linked better.
    for _ in 0..2 {
        let options = &settings.config.scale.advanced.unit;
        let unit =
            unit::of(vehicles, &trajectory.world_from_camera, mean_interval_s(&record.frames), options);
        let Some(unit) = unit else { break };
        let motion = trajectory.in_metres(
            unit.metres,
            0..record.frames.len(),
            &record.timestamps_ns(),
            &settings.config.odometry.advanced.external,
        );
        *ego = EgoTrajectory::metric(
            &motion,
            &[],
            settings.height_m,
            unit.sigma,
            &settings.config.scale.advanced.metric,
        );
        *vehicles = vehicles_of_drive(record, ego, settings, stop);
        found = Some(unit);
    }
    found
}

type Solved = Option<(MultibodyGraph, Report)>;

fn solve_graph(
    record: &FrontEndRecord,
    ego: &mut EgoTrajectory,
    vehicles: &mut [VehicleTrajectory],
    loops: &Loops,
    settings: &Settings,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Solved, GraphError> {
    let options = &settings.config.graph;
    if stop() {
        return Err(GraphError::Stopped);
    }
    if !options.enabled || ego.frames.is_empty() {
        return Ok(None);
    }
    let mut graph = MultibodyGraph::drive(options, settings.threads)?;
    graph = graph.with_places(loops.edges(), &settings.config.loops);
    let times_s = times_s(&record.frames);
    let frames = WindowFrames { first: 0, times_s: &times_s };
    let report = graph.update_unless(&frames, ego, vehicles, Stop::new(stop))?;
    Ok(Some((graph, report)))
}
