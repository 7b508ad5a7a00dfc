//! Time per stage and frame.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Instant;

use serde::{Deserialize, Serialize};

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

/// Width of a bin of times \[log ms\]: a percent.
const BIN: f64 = 0.01;
/// Time of the first bin \[ms\]; shorter ones count as that.
const SHORTEST_MS: f64 = 1e-3;

/// Times of a stage, counted in bins: the same memory for a minute and for a week.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Laps {
    bins: Vec<u32>,
    count: usize,
    total_ms: f64,
}

impl Laps {
    fn add(&mut self, lap_ms: f64) {
        let bin = ((lap_ms.max(SHORTEST_MS) / SHORTEST_MS).ln() / BIN) as usize;
        if bin >= self.bins.len() {
            self.bins.resize(bin + 1, 0);
        }
        self.bins[bin] = self.bins[bin].saturating_add(1);
        self.count += 1;
        self.total_ms += lap_ms;
    }

    fn join(&mut self, other: &Self) {
        self.bins.resize(self.bins.len().max(other.bins.len()), 0);
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.count += other.count;
        self.total_ms += other.total_ms;
    }

    /// Time that a share of the laps does not exceed \[ms\], to a percent.
    fn quantile_ms(&self, share: f64) -> f64 {
        let wanted = share * self.count as f64;
        let mut below = 0.0;
        let bin = self.bins.iter().position(|n| {
            below += f64::from(*n);
            *n > 0 && below >= wanted
        });
        bin.map_or(0.0, |bin| SHORTEST_MS * ((bin as f64 + 0.5) * BIN).exp())
    }
}

/// A stopwatch with the laps of each stage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Stopwatch {
    laps: BTreeMap<Cow<'static, str>, Laps>,
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
        self.laps.entry(Cow::Borrowed(stage)).or_default().add(lap_ms);
    }
    /// Takes over the laps of another one.
    pub fn join(&mut self, other: &Self) {
        for (stage, laps) in &other.laps {
            self.laps.entry(stage.clone()).or_default().join(laps);
        }
    }
    /// Summary by stage name; quantiles are known to a percent.
    pub fn summary(&self) -> BTreeMap<&str, StageTime> {
        let one = |laps: &Laps| StageTime {
            p50_ms: laps.quantile_ms(0.5),
            p95_ms: laps.quantile_ms(0.95),
            total_s: laps.total_ms / 1e3,
        };
        self.laps.iter().map(|(stage, laps)| (stage.as_ref(), one(laps))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_known_to_a_percent_in_the_memory_of_a_few_bins() {
        let (mut first, mut second) = (Stopwatch::default(), Stopwatch::default());
        for k in 0..100_000 {
            let watch = if k % 2 == 0 { &mut first } else { &mut second };
            watch.add("road", 5.0 + 10.0 * f64::from(k) / 100_000.0);
        }
        first.join(&second);
        let time = first.summary()["road"].clone();
        assert!(
            (time.p50_ms / 10.0 - 1.0).abs() < 0.01 && (time.p95_ms / 14.5 - 1.0).abs() < 0.01,
            "{time:?}"
        );
        assert!((time.total_s - 1000.0).abs() < 0.1);
        assert!(first.laps["road"].bins.len() < 1000);
        first.add("none", 0.0);
        assert!(first.summary()["none"].p50_ms < 2e-3);
    }
}
