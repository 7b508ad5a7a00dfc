//! The whole pipeline on synthetic drives: bounds on the errors of every scenario.
//!
//! A few short drives run with every test run; all of them by
//! `cargo test --release -p motorcade-simulate --test suite -- --ignored --nocapture`, which prints the table of
//! `BENCHMARK.md` as Markdown.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

mod bad_light;
mod cases;
mod driven;
mod frame_rates;
mod nees;
mod outcome;
mod rolling;
mod vehicles;

use cases::{Case, FULL, SHORT};
use outcome::{Outcome, run};
use rayon::prelude::*;
use vehicles::VehicleCase;

/// Every bound that is missed, in words.
fn missed(case: &Case, outcome: &Outcome) -> Vec<String> {
    let over = |what: &str, found: Option<f64>, most: Option<f64>, unit: &str| match (found, most) {
        (Some(found), Some(most)) if found > most => {
            Some(format!("{}: {what} {found:.3} {unit}, bound {most} {unit}", case.name))
        }
        (None, Some(_)) => Some(format!("{}: no {what} at all", case.name)),
        _ => None,
    };
    let bounds = &case.bounds;
    [
        over("ego ATE", Some(outcome.ego_ate_m), Some(bounds.ego_ate_m), "m"),
        over("scale error", Some(outcome.scale_pct.abs()), Some(bounds.scale_pct), "%"),
        over("vehicle ATE", outcome.vehicle_ate_m, bounds.vehicle_ate_m, "m"),
        over(
            "uncovered share",
            outcome.coverage.map(|c| 100.0 * (1.0 - c)),
            bounds.coverage_pct.map(|c| 100.0 - c),
            "%",
        ),
        over("NEES outside", Some(100.0 * (1.0 - outcome.nees.within)), Some(100.0 - bounds.nees_pct), "%"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn within_bounds(cases: &[Case]) {
    let start = std::time::Instant::now();
    // Drives side by side, the table in order.
    let outcomes: Vec<Outcome> = cases.par_iter().map(run).collect();
    let took_s = start.elapsed().as_secs_f64();
    println!("{}", Outcome::HEAD);
    let mut failures = Vec::new();
    for (case, outcome) in cases.iter().zip(&outcomes) {
        println!("{}", outcome.row(case));
        failures.extend(missed(case, outcome));
    }
    println!("\n{} drives in {took_s:.0} s on {} threads", cases.len(), rayon::current_num_threads());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Drives of minutes that come to a place again: `tests/all/places.rs` renders parts of them, `scripts/loops.py` judges whole ones.
const SEEN_AGAIN: [&str; 7] =
    ["block", "figure-eight", "tunnel", "town-10min", "suburb", "twin-houses", "same-street-opposite"];

#[test]
fn short_drives_stay_within_their_bounds() {
    within_bounds(SHORT);
}

#[test]
#[ignore = "a minute: nine drives, rendered and run"]
fn every_scenario_of_bad_light_is_within_its_bounds_or_wide() {
    let outcomes = bad_light::outcomes();
    println!("{}", bad_light::HEAD);
    for (case, outcome) in &outcomes {
        println!("{}", bad_light::row(case, outcome));
    }
    let problems: Vec<String> = outcomes.iter().filter_map(|(c, o)| bad_light::problem(c, o)).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
#[ignore = "a minute: three drives, rendered and run twice"]
fn every_scenario_of_a_rolling_shutter_stays_within_the_bounds_of_a_global_one() {
    let outcomes = rolling::outcomes();
    println!("{}", rolling::HEAD);
    for (case, [known, ignored]) in &outcomes {
        println!("{}", rolling::row(case, "30 ms, known", known));
        println!("{}", rolling::row(case, "30 ms, ignored", ignored));
    }
    let problems: Vec<String> = outcomes.iter().flat_map(|(case, [known, _])| missed(case, known)).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
#[ignore = "minutes: every scenario, rendered and run"]
fn every_scenario_stays_within_its_bounds() {
    let names: Vec<String> = motorcade_simulate::scenarios().into_iter().map(|s| s.name).collect();
    let cases: Vec<&str> = FULL.iter().map(|c| c.name).collect();
    let bounded = |n: &String| cases.contains(&n.as_str()) || SEEN_AGAIN.contains(&n.as_str());
    assert!(names.iter().all(bounded), "a scenario has no bounds: {names:?}");
    // One scenario alone: `MOTORCADE_SUITE_ONLY=demo`.
    let only = std::env::var("MOTORCADE_SUITE_ONLY").ok();
    let chosen: Vec<Case> =
        FULL.iter().filter(|c| only.as_ref().is_none_or(|name| name == c.name)).copied().collect();
    within_bounds(&chosen);
}

fn vehicles_within_bounds(cases: &'static [VehicleCase]) {
    let outcomes = vehicles::outcomes(cases);
    println!("{}", vehicles::HEAD);
    for (case, report) in &outcomes {
        println!("{}", vehicles::row(case, report));
    }
    let problems: Vec<String> = outcomes.iter().filter_map(|(c, r)| vehicles::problem(c, r)).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
#[ignore = "minutes: nine drives, rendered and run with networks"]
fn every_scenario_of_vehicles_from_pixels_stays_within_its_bounds() {
    vehicles_within_bounds(vehicles::CASES);
}

#[test]
#[ignore = "minutes: four drives, rendered and run with networks; not in CI"]
fn further_scenarios_of_vehicles_from_pixels_stay_within_their_bounds() {
    vehicles_within_bounds(vehicles::FURTHER);
}

#[test]
fn a_missed_bound_is_reported() {
    let case = &SHORT[0];
    let bad = Outcome { ego_ate_m: 99.0, scale_pct: -50.0, ..Outcome::default() };
    let reported = missed(case, &bad);
    assert!(reported.len() >= 2 && reported[0].contains("ego ATE 99.000 m"), "{reported:?}");
}
