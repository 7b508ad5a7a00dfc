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
    /// Least shares of positions and headings whose NEES lies below the 95 % quantile \[%\].
    nees_pct: [f64; 2],
}

type CaseBounds = (f64, usize, f64, [f64; 2]);

const fn case(name: &'static str, frames: usize, weather: Weather, bounds: CaseBounds) -> VehicleCase {
    let (ap3d_pct, id_switches, depth_pct, nees_pct) = bounds;
    VehicleCase { name, frames, weather, ap3d_pct, id_switches, depth_pct, nees_pct }
}

/// Drives with vehicles that count.
#[rustfmt::skip] // one drive a line
pub const CASES: &[VehicleCase] = &[
    case("parked", 60, Clear, (85.0, 12, 92.0, [88.0, 88.0])),
    case("oncoming", 60, Overcast, (85.0, 4, 92.0, [88.0, 88.0])),
    case("overtaking", 60, Overcast, (90.0, 1, 92.0, [88.0, 80.0])),
    case("crossing", 60, Clear, (45.0, 4, 92.0, [88.0, 73.0])),
    case("dense", 60, Clear, (75.0, 8, 92.0, [88.0, 86.0])),
    case("parked-across", 50, Clear, (50.0, 25, 92.0, [88.0, 88.0])),
    case("roundabout-exits", 60, Clear, (50.0, 4, 92.0, [88.0, 85.0])),
    case("motorway", 50, Clear, (60.0, 3, 62.0, [62.0, 88.0])),
    case("crest", 50, Clear, (50.0, 4, 85.0, [40.0, 88.0])),
];

/// Drives that CI has no time for.
#[rustfmt::skip] // one drive a line
pub const FURTHER: &[VehicleCase] = &[
    case("yard", 60, Clear, (55.0, 4, 92.0, [88.0, 88.0])),
    case("double-parked", 60, Overcast, (12.0, 4, 92.0, [88.0, 88.0])),
    case("junction-turn", 60, Overcast, (72.0, 4, 92.0, [88.0, 80.0])),
    case("trailers", 60, Clear, (85.0, 4, 92.0, [88.0, 88.0])),
];

pub const HEAD: &str = "| scenario | frames | AP 0.5 (bound) | AP 0.7 | sAMOTA | HOTA | switches (bound) | depth below 2 σ (bound) | largest | position, heading NEES (bound) | P(moving), Brier |\n|---|---|---|---|---|---|---|---|---|---|---|";

/// Each case with what its run comes to.
pub fn outcomes(cases: &'static [VehicleCase]) -> Vec<(&'static VehicleCase, Report)> {
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
    // One scenario alone: `MOTORCADE_SUITE_ONLY=parked`.
    let only = std::env::var("MOTORCADE_SUITE_ONLY").ok();
    cases.par_iter().filter(|c| only.as_ref().is_none_or(|name| name == c.name)).map(one).collect()
}

/// Figures of a run.
struct Figures {
    /// 3D AP|R40 of moderate labels at 0.5 and 0.7, sAMOTA, HOTA \[%\].
    shares_pct: [f64; 4],
    id_switches: usize,
    /// Share of depths below two deviations \[%\].
    depth_pct: f64,
    /// Largest error of depth \[deviations\].
    largest_sigma: f64,
    /// Shares of positions and headings whose NEES lies below the 95 % quantile \[%\].
    nees_pct: [f64; 2],
    brier: f64,
}

impl Figures {
    fn of(report: &Report) -> Option<Self> {
        let (boxes, consistency) = (report.boxes3d?, report.vehicles_consistency?);
        let (in_3d, in_2d) = (report.tracking3d?.iou_25, report.tracking2d?);
        Some(Self {
            shares_pct: [boxes.ap3d_50.moderate, boxes.ap3d_70.moderate, in_3d.samota, in_2d.hota],
            id_switches: in_2d.id_switches,
            depth_pct: 100.0 * consistency.depth.within_two_sigma,
            largest_sigma: consistency.depth.largest_sigma,
            nees_pct: [consistency.position, consistency.heading].map(|part| 100.0 * part.nees_allowed),
            brier: report.moving.as_ref()?.brier,
        })
    }
}

pub fn row(case: &VehicleCase, report: &Report) -> String {
    let Some(figures) = Figures::of(report) else {
        return format!("| {} | no labelled vehicle was found |", case.name);
    };
    let Figures { shares_pct, id_switches, depth_pct, largest_sigma, nees_pct, brier } = figures;
    let ([ap_50, ap_70, samota, hota], [position, heading]) = (shares_pct, nees_pct);
    format!(
        "| {} | {} | {ap_50:.1} % ({}) | {ap_70:.1} % | {samota:.1} % | {hota:.1} % | {id_switches} ({}) | {depth_pct:.1} % ({}) | {largest_sigma:.1} σ | {position:.0}, {heading:.0} % ({}, {}) | {brier:.3} |",
        case.name,
        case.frames,
        case.ap3d_pct,
        case.id_switches,
        case.depth_pct,
        case.nees_pct[0],
        case.nees_pct[1]
    )
}

/// Row of a case of which a figure is worse than its bound, in words.
pub fn problem(case: &VehicleCase, report: &Report) -> Option<String> {
    let Some(figures) = Figures::of(report) else {
        return Some(format!("{}: no labelled vehicle was found", case.name));
    };
    let consistent = figures.depth_pct >= case.depth_pct
        && figures.nees_pct.iter().zip(&case.nees_pct).all(|(found, least)| found >= least);
    let within =
        figures.shares_pct[0] >= case.ap3d_pct && figures.id_switches <= case.id_switches && consistent;
    (!within).then(|| row(case, report))
}
