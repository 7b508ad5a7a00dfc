//! A rolling shutter of 30 ms: with its time known within the bounds of the standard camera.

use rayon::prelude::*;

use super::cases::{Case, FULL};
use super::outcome::{Outcome, run_rolling};

/// Time from the first row to the last \[s\]: that of common CMOS sensors at 30 frames/s.
const READOUT_S: f64 = 0.03;
/// A straight road, bends, parked cars.
const SCENARIOS: [&str; 3] = ["straight", "roundabout", "parked"];

pub const HEAD: &str = "| scenario | readout | ego ATE (bound) | scale (bound) | sigma | vehicle ATE (bound) | NEES < 12.6 |\n|---|---|---|---|---|---|---|";

/// Every scenario with the time known, and with it taken for 0.
pub fn outcomes() -> Vec<(Case, [Outcome; 2])> {
    let cases: Vec<Case> =
        SCENARIOS.iter().filter_map(|name| FULL.iter().find(|c| c.name == *name)).copied().collect();
    assert_eq!(cases.len(), SCENARIOS.len());
    cases
        .into_par_iter()
        .map(|case| (case, [READOUT_S, 0.0].map(|assumed_s| run_rolling(&case, [READOUT_S, assumed_s]))))
        .collect()
}

pub fn row(case: &Case, known: &str, outcome: &Outcome) -> String {
    let bounds = &case.bounds;
    let vehicle = outcome.vehicle_ate_m.map_or_else(|| "–".to_owned(), |ate| format!("{ate:.2} m"));
    let vehicle_bound = bounds.vehicle_ate_m.map_or_else(|| "–".to_owned(), |b| format!("{b}"));
    format!(
        "| {} | {known} | {:.2} m ({}) | {:+.1} % ({}) | {:.1} % | {vehicle} ({vehicle_bound}) | {:.0} % |",
        case.name,
        outcome.ego_ate_m,
        bounds.ego_ate_m,
        outcome.scale_pct,
        bounds.scale_pct,
        100.0 * outcome.scale_sigma,
        100.0 * outcome.nees.within,
    )
}
