//! Time per stage and frame.

use std::collections::BTreeMap;
use std::time::Instant;

use motorcade_geometry::robust::quantile;
use serde::Serialize;

/// Times of one stage over the frames of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageTime {
    /// Median \[ms a frame\].
    pub p50_ms: f64,
    /// 95th percentile \[ms a frame\].
    pub p95_ms: f64,
    /// Sum \[s\].
    pub total_s: f64,
}

/// A stopwatch with a lap list per stage.
#[derive(Clone, Debug, Default)]
pub struct Stopwatch {
    laps_ms: BTreeMap<&'static str, Vec<f64>>,
}

impl Stopwatch {
    /// Runs `work` and adds its time to `stage`.
    pub fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let out = work();
        self.add(stage, start.elapsed().as_secs_f64() * 1e3);
        out
    }
    /// Adds a lap \[ms\].
    pub fn add(&mut self, stage: &'static str, lap_ms: f64) {
        self.laps_ms.entry(stage).or_default().push(lap_ms);
    }
    /// Takes over the laps of another one.
    pub fn join(&mut self, other: &Self) {
        for (stage, laps) in &other.laps_ms {
            self.laps_ms.entry(stage).or_default().extend(laps);
        }
    }
    /// Summary by stage name.
    pub fn summary(&self) -> BTreeMap<&'static str, StageTime> {
        let one = |laps: &Vec<f64>| {
            let total_s = laps.iter().sum::<f64>() / 1e3;
            let mut laps = laps.clone();
            let mut at = |share: f64| quantile(&mut laps, share).unwrap_or(0.0);
            StageTime { p50_ms: at(0.5), p95_ms: at(0.95), total_s }
        };
        self.laps_ms.iter().map(|(stage, laps)| (*stage, one(laps))).collect()
    }
}
