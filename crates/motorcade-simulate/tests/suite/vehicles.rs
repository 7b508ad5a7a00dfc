//! Vehicles from pixels, with the networks inside the program: average precision, identities, deviations.

use motorcade_evaluate::Report;
use motorcade_perception::PerceptionOptions;
use motorcade_simulate::RenderOptions;
use motorcade_simulate::Weather::{self, Clear, Overcast};
use rayon::prelude::*;

use super::cases::{Bounds, Case};
use super::driven::{Way, asked, drive};

/// Bounds of a drive.
pub struct VehicleCase {
    name: &'static str,
    frames: usize,
    weather: Weather,
    /// Least 3D AP|R40 of moderate labels at an overlap of 0.5 \[%\].
    ap3d_pct: f64,
    /// Most identity switches by TrackEval's definition.
    id_switches: usize,
    /// Least share of depths below twice their deviation \[%\].
    depth_pct: f64,
}

const fn case(name: &'static str, frames: usize, weather: Weather, bounds: (f64, usize, f64)) -> VehicleCase {
    let (ap3d_pct, id_switches, depth_pct) = bounds;
    VehicleCase { name, frames, weather, ap3d_pct, id_switches, depth_pct }
}

/// Drives with vehicles that count.
#[rustfmt::skip] // one drive a line
const CASES: [VehicleCase; 5] = [
    case("parked", 60, Clear, (85.0, 40, 92.0)),
    case("oncoming", 60, Overcast, (85.0, 4, 92.0)),
    case("overtaking", 60, Overcast, (90.0, 1, 92.0)),
    case("crossing", 60, Clear, (45.0, 4, 92.0)),
    case("dense", 60, Clear, (75.0, 8, 92.0)),
];

pub const HEAD: &str = "| scenario | AP 0.5 (bound) | AP 0.7 | sAMOTA | HOTA | switches (bound) | depth below 2 σ (bound) | largest | P(moving), Brier |\n|---|---|---|---|---|---|---|---|---|";

/// Each case with what its run comes to.
pub fn outcomes() -> Vec<(&'static VehicleCase, Report)> {
    let one = |of: &'static VehicleCase| {
        let bounds =
            Bounds { ego_ate_m: 0.0, scale_pct: 0.0, vehicle_ate_m: None, coverage_pct: None, nees_pct: 0.0 };
        let case = Case { name: of.name, frames: of.frames, weather: of.weather, width_px: 1242, bounds };
        let way = Way {
            fps: RenderOptions::default().fps,
            online: false,
            shutter_s: [0.0; 2],
            seed: asked("SEED", 1),
        };
        (of, drive(&case, &way, |_| PerceptionOptions::default()).report)
    };
    CASES.par_iter().map(one).collect()
}

/// Average precision at 0.5 and 0.7, sAMOTA, HOTA, switches, share of depths below two deviations, largest error in deviations, Brier score.
fn figures(report: &Report) -> Option<([f64; 4], usize, [f64; 3])> {
    let (boxes, depth) = (report.boxes3d?, report.vehicles_consistency?.depth);
    let (in_3d, in_2d) = (report.tracking3d?.iou_25, report.tracking2d?);
    let shares = [boxes.ap3d_50.moderate, boxes.ap3d_70.moderate, in_3d.samota, in_2d.hota];
    let brier = report.moving.as_ref()?.brier;
    Some((shares, in_2d.id_switches, [100.0 * depth.within_two_sigma, depth.largest_sigma, brier]))
}

pub fn row(case: &VehicleCase, report: &Report) -> String {
    let Some(([ap_50, ap_70, samota, hota], switches, [below, largest, brier])) = figures(report) else {
        return format!("| {} | no labelled vehicle was found |", case.name);
    };
    format!(
        "| {} | {ap_50:.1} % ({}) | {ap_70:.1} % | {samota:.1} % | {hota:.1} % | {switches} ({}) | {below:.1} % ({}) | {largest:.1} σ | {brier:.3} |",
        case.name, case.ap3d_pct, case.id_switches, case.depth_pct
    )
}

/// Row of a case of which a figure is worse than its bound, in words.
pub fn problem(case: &VehicleCase, report: &Report) -> Option<String> {
    let Some(([ap_50, ..], switches, [below, ..])) = figures(report) else {
        return Some(format!("{}: no labelled vehicle was found", case.name));
    };
    let within = ap_50 >= case.ap3d_pct && switches <= case.id_switches && below >= case.depth_pct;
    (!within).then(|| row(case, report))
}
