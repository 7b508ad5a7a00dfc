//! Errors of one scenario.

use motorcade_evaluate::evaluate_trajectory;
use motorcade_perception::{ModelSource, PerceptionOptions};
use motorcade_simulate::{RenderOptions, Weather, Written};
use motorcade_vehicles::VehicleTrajectory;

use super::cases::Case;
use super::driven::{Driven, Way, asked, drive};
use super::nees::{Nees, nees};

const SEED: u64 = 1;

/// Errors of a run.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    pub length_m: f64,
    /// SE(3)-aligned.
    pub ego_ate_m: f64,
    /// The same from the first frame on whose metres were measured: an online run reports those before by a guess, which says so.
    pub ego_ate_in_metres_m: f64,
    /// Estimated over true length of the path, less one; 0 where the camera hardly moves.
    pub scale_pct: f64,
    pub vehicles: usize,
    /// Mean over the vehicles, after the SE(3) alignment of the camera's path.
    pub vehicle_ate_m: Option<f64>,
    pub coverage: Option<f64>,
    pub nees: Nees,
    /// Relative standard deviation of scale, a mean over the frames.
    pub scale_sigma: f64,
    /// Share of the frames with a pose of their own.
    pub tracked: f64,
    /// Share of the frames whose scale was measured.
    pub measured: f64,
    /// Warnings of the run.
    pub warnings: Vec<String>,
    /// Mean P(moving) of vehicles that were seen for a second and more.
    pub moving: f64,
}

impl Outcome {
    pub const HEAD: &str = "| scenario | frames | width | way | ego ATE (bound) | scale (bound) | vehicles | vehicle ATE (bound) | coverage (bound) | NEES < 12.6 (bound) | median |\n|---|---|---|---|---|---|---|---|---|---|---|";

    pub fn row(&self, case: &Case) -> String {
        let b = &case.bounds;
        let or_none = |value: Option<String>| value.unwrap_or_else(|| "–".into());
        let ate = self.vehicle_ate_m.map(|v| {
            let bound = b.vehicle_ate_m.map_or_else(|| "–".into(), |b| format!("{b}"));
            format!("{v:.2} m ({bound})")
        });
        let coverage = self.coverage.map(|c| {
            let bound = b.coverage_pct.map_or_else(|| "–".into(), |b| format!("{b}"));
            format!("{:.0} % ({bound})", 100.0 * c)
        });
        let weather = match case.weather {
            Weather::Rain => ", rain",
            _ => "",
        };
        format!(
            "| {}{weather} | {} | {} | {:.0} m | {:.2} m ({}) | {:+.1} % ({}) | {} | {} | {} | {:.0} % ({}) | {:.1} |",
            case.name,
            case.frames,
            case.width_px,
            self.length_m,
            self.ego_ate_m,
            b.ego_ate_m,
            self.scale_pct,
            b.scale_pct,
            self.vehicles,
            or_none(ate),
            or_none(coverage),
            100.0 * self.nees.within,
            b.nees_pct,
            self.nees.median,
        )
    }
}

/// Source of boxes and road: the simulator's detector and masks, whose errors are known, or with
/// `MOTORCADE_SUITE_PERCEPTION=networks` the networks inside the program, on the rendered pixels.
pub fn perception(written: &Written) -> PerceptionOptions {
    match std::env::var("MOTORCADE_SUITE_PERCEPTION").as_deref() {
        Ok(asked) => {
            assert_eq!(asked, "networks", "MOTORCADE_SUITE_PERCEPTION");
            PerceptionOptions::default()
        }
        Err(_) => PerceptionOptions {
            models: ModelSource::None,
            detections: Some(written.detections.clone()),
            road_masks: written.road_masks.clone(),
            ..PerceptionOptions::default()
        },
    }
}

/// Mean P(moving) of vehicles that were seen for a second and more.
fn moving(vehicles: &[VehicleTrajectory], least: usize) -> f64 {
    let long: Vec<f64> = vehicles.iter().filter(|v| v.states.len() >= least).map(|v| v.p_moving).collect();
    long.iter().sum::<f64>() / long.len().max(1) as f64
}

/// A case at the rate of the bounds, as a whole.
pub fn run(case: &Case) -> Outcome {
    run_at(case, RenderOptions::default().fps, false, asked("SEED", SEED))
}

/// A case seen by a rolling shutter whose rows take `readout_s`, for which the pipeline takes `assumed_s`.
pub fn run_rolling(case: &Case, [readout_s, assumed_s]: [f64; 2]) -> Outcome {
    run_with(case, RenderOptions::default().fps, false, [readout_s, assumed_s], asked("SEED", SEED))
}

/// A case with as many frames as its motion has at this rate, as a whole or online.
pub fn run_at(case: &Case, fps: f64, online: bool, seed: u64) -> Outcome {
    run_with(case, fps, online, [0.0; 2], seed)
}

fn run_with(case: &Case, fps: f64, online: bool, shutter_s: [f64; 2], seed: u64) -> Outcome {
    let Driven { result, report, true_poses } =
        drive(case, &Way { fps, online, shutter_s, seed }, perception);
    let estimated: Vec<_> = result.ego.frames.iter().map(|f| f.world_from_camera).collect();
    let first = result.ego.frames.iter().position(|f| f.scale_measured).unwrap_or(0);
    let in_metres = evaluate_trajectory(&estimated[first..], &true_poses[first..]).unwrap();
    let means = report.vehicles_mean;
    let count = result.ego.frames.len().max(1) as f64;
    let sigmas = result.ego.frames.iter().map(|f| f.scale_sigma.hypot(f.scale_bias_sigma));
    Outcome {
        length_m: report.ego.length_m,
        ego_ate_m: report.ego.ate_se3_m,
        ego_ate_in_metres_m: in_metres.ate_se3_m,
        scale_pct: report.ego.best_scale.map_or(0.0, |s| 100.0 * (1.0 / s - 1.0)),
        vehicles: report.vehicles.as_ref().map_or(0, Vec::len),
        vehicle_ate_m: means.as_ref().map(|m| m.ate_ego_se3_m),
        coverage: means.as_ref().map(|m| m.coverage),
        scale_sigma: sigmas.sum::<f64>() / count,
        tracked: result.tracked_share(),
        measured: result.ego.frames.iter().filter(|f| f.scale_measured).count() as f64 / count,
        warnings: result.warnings.clone(),
        moving: moving(&result.vehicles, fps.round() as usize),
        nees: nees(&result.ego.frames, &true_poses).unwrap_or_default(),
    }
}
