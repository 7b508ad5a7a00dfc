//! Night, low sun, tunnel and mirroring asphalt on three scenarios: within the bounds of the scenario, or wide and with a warning.

use motorcade_simulate::Weather::{self, LowSun, Night, Tunnel, WetMirror};
use rayon::prelude::*;

use super::cases::{Case, FULL};
use super::missed;
use super::outcome::{Outcome, run};

/// Weathers of the test; `MOTORCADE_SUITE_WEATHER` selects another one.
const WEATHERS: [Weather; 4] = [LowSun, Tunnel, Night, WetMirror];
/// A straight road behind a car, bends with oncoming traffic, parked cars.
const SCENARIOS: [&str; 3] = ["straight", "roundabout", "parked"];
/// Largest error of scale over its standard deviation.
const MOST_SIGMAS: f64 = 2.0;
/// Share of untracked frames above which a run fails and says so (exit code 4).
const MOST_UNTRACKED: f64 = 0.2;
/// Factor on the bounds of ATE: those of the scenarios are for daylight.
const ATE_FACTOR: f64 = 1.5;

pub const HEAD: &str = "| weather | scenario | tracked | scale measured | ego ATE (bound) | scale (bound) | sigma | error in sigmas | vehicle ATE (bound) | warnings |\n|---|---|---|---|---|---|---|---|---|---|";

/// Every scenario in every weather.
pub fn outcomes() -> Vec<(Case, Outcome)> {
    let asked = std::env::var("MOTORCADE_SUITE_WEATHER").ok();
    let weathers: Vec<Weather> = match &asked {
        Some(name) => Weather::ALL.into_iter().filter(|w| w.name() == name).collect(),
        None => WEATHERS.to_vec(),
    };
    let in_weather = |weather: Weather| {
        let case = |name: &&str| FULL.iter().find(|case| case.name == *name).copied();
        SCENARIOS.iter().filter_map(case).map(move |case| {
            let mut case = Case { weather, ..case };
            case.bounds.ego_ate_m *= ATE_FACTOR;
            case
        })
    };
    let cases: Vec<Case> = weathers.into_iter().flat_map(in_weather).collect();
    assert!(!cases.is_empty(), "no such weather: {asked:?}");
    cases.into_par_iter().map(|case| (case, run(&case))).collect()
}

fn sigmas(outcome: &Outcome) -> f64 {
    (0.01 * outcome.scale_pct).ln_1p().abs() / outcome.scale_sigma
}

pub fn row(case: &Case, outcome: &Outcome) -> String {
    let bounds = &case.bounds;
    let vehicle = outcome.vehicle_ate_m.map_or_else(|| "–".to_owned(), |ate| format!("{ate:.2} m"));
    let vehicle_bound = bounds.vehicle_ate_m.map_or_else(|| "–".to_owned(), |b| format!("{b}"));
    let warnings = if outcome.warnings.is_empty() { "–".to_owned() } else { outcome.warnings.join("; ") };
    format!(
        "| {} | {} | {:.0} % | {:.0} % | {:.2} m ({:.2}) | {:+.1} % ({}) | {:.1} % | {:.1} | {vehicle} ({vehicle_bound}) | {warnings} |",
        case.weather.name(),
        case.name,
        100.0 * outcome.tracked,
        100.0 * outcome.measured,
        outcome.ego_ate_m,
        bounds.ego_ate_m,
        outcome.scale_pct,
        bounds.scale_pct,
        100.0 * outcome.scale_sigma,
        sigmas(outcome),
    )
}

/// Faults of an outcome: figures beyond the bounds that are neither wide and with a warning nor reported as failed.
pub fn problem(case: &Case, outcome: &Outcome) -> Option<String> {
    let missed = missed(case, outcome);
    let warned = !outcome.warnings.is_empty();
    let (wide, failed) = (sigmas(outcome) < MOST_SIGMAS, outcome.tracked < 1.0 - MOST_UNTRACKED);
    (!missed.is_empty() && !(warned && (wide || failed)))
        .then(|| format!("{}: {}", case.weather.name(), missed.join("; ")))
}
