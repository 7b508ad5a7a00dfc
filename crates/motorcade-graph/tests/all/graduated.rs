//! Graduated non-convexity against gross outliers.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::common::{difference, pose, random, small_drive};
use motorcade_graph::factors::Between;
use motorcade_graph::solver::{Control, GraduateOptions, Termination, graduate};
use motorcade_graph::{Graph, GroupId, LossScale, Options, Robust, RobustKernel, optimise};
use nalgebra::Matrix6;

const C: f64 = 3.55;

/// Adds wrong loop closures, in a group under Geman–McClure kernels if asked for.
fn spoil(graph: &mut Graph, robust: bool) -> GroupId {
    let group = graph.add_group();
    let ids: Vec<_> = graph.values().iter().map(|(id, _)| id).collect();
    let rng = &mut random(7);
    for (a, b) in [(3, 60), (20, 90), (41, 77), (8, 95)] {
        let wrong = Between::new(ids[a], ids[b], pose(rng, 3.0), Matrix6::identity() * 100.0).unwrap();
        let kernel = if robust { RobustKernel::GemanMcClure(C) } else { RobustKernel::None };
        let id = graph.add_factor(Robust::new(wrong, kernel)).unwrap();
        graph.assign(id, group).unwrap();
    }
    group
}

#[test]
fn graduation_finds_the_solution_without_outliers() {
    let mut clean = small_drive(11);
    optimise(&mut clean, &Options::default()).unwrap();
    let mut plain = small_drive(11);
    spoil(&mut plain, false);
    optimise(&mut plain, &Options::default()).unwrap();
    let mut robust = small_drive(11);
    let group = spoil(&mut robust, true);
    let schedule = GraduateOptions { c: C, ..GraduateOptions::default() };
    let report = graduate(&mut robust, group, &Options::default(), &schedule, &Control::default()).unwrap();
    assert!(report.converged() && robust.scale(group) == LossScale::convexity(1.0));
    assert!(difference(&clean, &plain) > 0.1);
    assert!(difference(&clean, &robust) < 0.01, "{}", difference(&clean, &robust));
    let broken = GraduateOptions { factor: 1.0, ..schedule };
    assert!(graduate(&mut robust, group, &Options::default(), &broken, &Control::default()).is_err());
}

#[test]
fn graduation_heeds_cancellation_and_time_as_a_whole() {
    let run = |options: &Options, cancelled: bool| {
        let mut graph = small_drive(11);
        let group = spoil(&mut graph, true);
        let schedule = GraduateOptions { c: C, ..GraduateOptions::default() };
        let cancel = Some(Arc::new(AtomicBool::new(cancelled)));
        let control = Control { cancel, progress: None };
        let report = graduate(&mut graph, group, options, &schedule, &control).unwrap();
        assert!(graph.scale(group) == LossScale::convexity(1.0));
        (report.termination, report.iterations.len())
    };
    let no_time = Options { time_limit_s: Some(0.0), ..Options::default() };
    assert_eq!(run(&no_time, false), (Termination::Time, 1));
    assert_eq!(run(&Options::default(), true), (Termination::Cancelled, 1));
    assert_eq!(run(&Options::default(), false).0, Termination::Converged);
}
