//! Graduated non-convexity against gross outliers, and kernels by name.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

mod common;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use common::{difference, pose, random, small_drive};
use motorcade_graph::command::RobustKernel;
use motorcade_graph::factors::Between;
use motorcade_graph::solver::{Control, GraduateOptions, Termination, graduate};
use motorcade_graph::{Gnc, Graph, Options, Robust, optimise};
use nalgebra::Matrix6;

/// Adds wrong loop closures, wrapped by `wrap`.
fn spoil(graph: &mut Graph, kernel: Option<&Gnc>) {
    let ids: Vec<_> = graph.values().iter().map(|(id, _)| id).collect();
    let rng = &mut random(7);
    for (a, b) in [(3, 60), (20, 90), (41, 77), (8, 95)] {
        let wrong = Between::new(ids[a], ids[b], pose(rng, 3.0), Matrix6::identity() * 100.0).unwrap();
        match kernel {
            Some(kernel) => graph.add_factor(Robust::new(wrong, kernel.clone())).unwrap(),
            None => graph.add_factor(wrong).unwrap(),
        };
    }
}

#[test]
fn graduation_finds_the_solution_without_outliers() {
    let mut clean = small_drive(11);
    optimise(&mut clean, &Options::default()).unwrap();
    let mut plain = small_drive(11);
    spoil(&mut plain, None);
    optimise(&mut plain, &Options::default()).unwrap();
    let kernel = Gnc::new(3.55);
    let mut robust = small_drive(11);
    spoil(&mut robust, Some(&kernel));
    let report =
        graduate(&mut robust, &kernel, &Options::default(), &GraduateOptions::default(), &Control::default())
            .unwrap();
    assert!(report.converged() && (kernel.mu() - 1.0).abs() < 1e-12);
    assert!(difference(&clean, &plain) > 0.1);
    assert!(difference(&clean, &robust) < 0.01, "{}", difference(&clean, &robust));
    let broken = GraduateOptions { factor: 1.0, ..Default::default() };
    assert!(graduate(&mut robust, &kernel, &Options::default(), &broken, &Control::default()).is_err());
}

#[test]
fn graduation_heeds_cancellation_and_time_as_a_whole() {
    let run = |options: &Options, cancelled: bool| {
        let kernel = Gnc::new(3.55);
        let mut graph = small_drive(11);
        spoil(&mut graph, Some(&kernel));
        let cancel = Some(Arc::new(AtomicBool::new(cancelled)));
        let control = Control { cancel, progress: None };
        let report = graduate(&mut graph, &kernel, options, &GraduateOptions::default(), &control).unwrap();
        assert!((kernel.mu() - 1.0).abs() < 1e-12);
        (report.termination, report.iterations.len())
    };
    let no_time = Options { time_limit_s: Some(0.0), ..Options::default() };
    assert_eq!(run(&no_time, false), (Termination::Time, 1));
    assert_eq!(run(&Options::default(), true), (Termination::Cancelled, 1));
    assert_eq!(run(&Options::default(), false).0, Termination::Converged);
}

#[test]
fn kernels_have_names() {
    for name in ["huber:2", "cauchy:3.5", "geman-mcclure:1", "dcs:12", "gnc:3.55"] {
        let kernel: RobustKernel = name.parse().unwrap();
        assert_eq!(serde_json::to_string(&kernel).unwrap(), format!("{name:?}"));
    }
    for wrong in ["cauchy:-1", "cauchy:x", "square:1", "huber:nan"] {
        assert!(wrong.parse::<RobustKernel>().unwrap_err().to_string().contains("robust"));
    }
}
