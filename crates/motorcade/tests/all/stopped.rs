//! Requests to stop once all frames are taken: the results hold what is estimated by then.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::sync::Mutex;

use motorcade::{Config, FrontEndRecord, NoProgress, Progress, RunResult, estimate_drive};

use crate::common::{drive, settings};

/// Asks to stop once a stage has begun and the request was looked at some times more.
struct StopsIn {
    stage: &'static str,
    looks_left: Mutex<Option<usize>>,
    looks: usize,
}

impl Progress for StopsIn {
    fn begin(&self, stage: &'static str, _total: Option<usize>) {
        if stage == self.stage {
            self.looks_left.lock().unwrap().get_or_insert(self.looks);
        }
    }
    fn advance(&self, _done: usize) {}
    fn warn(&self, _message: &str) {}
    fn cancelled(&self) -> bool {
        let mut left = self.looks_left.lock().unwrap();
        let asked = *left == Some(0);
        *left = left.map(|looks| looks.saturating_sub(1));
        asked
    }
}

const FRAMES: usize = 200;

fn stopped(stage: &'static str, looks: usize) -> RunResult {
    let progress = StopsIn { stage, looks_left: Mutex::new(None), looks };
    estimate_drive(drive(FRAMES), &settings(Config::default()), &progress)
}

/// All but the times that it took.
fn described(result: &RunResult) -> String {
    format!("{:?} {:?} {:?}", result.ego.frames, result.vehicles, result.warnings)
}

#[test]
fn a_drive_stopped_among_its_vehicles_or_in_the_graph_has_the_rest() {
    let whole = estimate_drive(drive(FRAMES), &settings(Config::default()), &NoProgress);
    assert!(whole.graph.is_some() && whole.vehicles.len() > 1 && !whole.interrupted);
    // Looks before every frame, forwards and backwards, before every track, and within the graph.
    let none = stopped("vehicles", 0);
    let some = stopped("vehicles", 2 * FRAMES + 1);
    let (before_graph, in_graph) = (stopped("graph", 0), stopped("graph", 1));
    assert_eq!(none.vehicles.len(), 0);
    assert!((1..whole.vehicles.len()).contains(&some.vehicles.len()), "{}", some.vehicles.len());
    assert_eq!([&before_graph, &in_graph].map(|r| r.vehicles.len()), [whole.vehicles.len(); 2]);
    for result in [none, some, before_graph, in_graph] {
        assert!(result.interrupted && !result.failed && result.graph.is_none());
        assert_eq!((result.ego.frames.len(), result.planned_frames), (FRAMES, Some(FRAMES)));
        let said = |words: &str| result.warnings.iter().any(|w| w.contains(words));
        assert!(said("stopped while ") && said("200 of 200 frames"), "{:?}", result.warnings);
    }
}

#[test]
fn a_drive_stopped_among_its_frames_is_estimated_from_those_before() {
    let record = || FrontEndRecord { interrupted: true, ..drive(FRAMES) };
    let whole = estimate_drive(record(), &settings(Config::default()), &NoProgress);
    let progress = StopsIn { stage: "", looks_left: Mutex::new(Some(0)), looks: 0 };
    let result = estimate_drive(record(), &settings(Config::default()), &progress);
    assert!(result.graph.is_some());
    assert_eq!(described(&result), described(&whole));
}
