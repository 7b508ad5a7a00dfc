//! A run aligned with a GPS track: heading, position and clock offset; the metres are the run's own.

mod deviations;

use motorcade::RecordedRun;
use motorcade_dataset::{ClockOffset, Geodetic, GpsTrack, TrackPoint};
use nalgebra::{Vector2, Vector3};

use crate::anchor::{Anchor, level_axes};
use crate::error::Error;

/// Settings of the alignment with a track. None of these numbers was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignOptions {
    /// Largest standard deviation of the heading that is a result \[deg\]. A larger one also places drives whose direction is nearly unknown.
    pub most_heading_sigma_deg: f64,
    /// Time for which the errors of a receiver last \[s\]: fixes that are nearer in time count as one. A longer one widens the standard deviations.
    pub correlated_s: f64,
    /// Step of the search for the clock offset \[s\]; finer ones follow around its best. A longer one is quicker and may miss it on winding roads.
    pub coarse_s: f64,
    /// Iterations of the reweighting.
    pub iterations: usize,
    /// Scale of the Cauchy kernel [standard deviations of a fix]: fixes between houses. A smaller one trusts the middle of the fixes more.
    pub kernel_sigmas: f64,
    /// Share of the run that the fixes must cover. A smaller one aligns drives of which the track holds a part.
    pub least_covered: f64,
    /// Half of the interval over which a velocity is taken \[s\]: 0.25 are five frames at 10 frames/s. A longer one smooths speeds that change.
    pub half_velocity_s: f64,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            most_heading_sigma_deg: 15.0,
            correlated_s: 10.0,
            coarse_s: 0.5,
            iterations: 15,
            kernel_sigmas: 2.0,
            least_covered: 0.4,
            half_velocity_s: 0.25,
        }
    }
}

/// The result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Place of the first camera.
    pub anchor: Anchor,
    /// Standard deviation of the clock offset \[s\].
    pub clock_sigma_s: f64,
    /// Root mean square of the horizontal distances, robustly weighted \[m\].
    pub rms_m: f64,
    /// Fixes used, and those of them that are outliers (over three standard deviations).
    pub fixes: (usize, usize),
}

/// A fix in the plane at the first one, and its standard deviation \[m\].
struct Fix {
    time_s: f64,
    at: Vector2<f64>,
    up: f64,
    sigma: f64,
}

/// A run in its own level plane: right, forward, up of the first camera \[m\].
struct LevelTrajectory {
    times_s: Vec<f64>,
    at: Vec<Vector3<f64>>,
}

/// Mean of ln(1 + r² / k²) for a fix that errs as it says in both coordinates, at a kernel of k = 2 standard deviations.
const COST_OF_A_FIX: f64 = 0.36;

/// Heading, shift and cost at one clock offset.
struct Fit {
    offset_s: f64,
    heading: f64,
    shift: Vector2<f64>,
    /// Robust cost of the fixes that are independent, and of the clock.
    cost: f64,
    weights: Vec<f64>,
    used: Vec<usize>,
    /// Standard deviation of the offset by the costs of all that were tried \[s\].
    offset_sigma_s: f64,
}

/// Aligns a run with a track. Clock offsets are looked for wherever at least half of the run lies within the track, or around
/// a clock offset that is known.
///
/// # Errors
/// A track that does not overlap, or a drive too short or slow to determine its heading.
pub fn align(
    run: &RecordedRun,
    track: &GpsTrack,
    known: Option<ClockOffset>,
    options: &AlignOptions,
) -> Result<Alignment, Error> {
    let wrong = |problem: String| Error::Alignment(problem);
    let origin = track.points.first().ok_or_else(|| wrong("the track is empty".into()))?.at;
    let fixes: Vec<Fix> = track.points.iter().map(|p| fix(&origin, p)).collect();
    let trajectory = trajectory(run).ok_or_else(|| wrong("the run has no frames".into()))?;
    let best = search(&trajectory, &fixes, known, options).ok_or_else(|| {
        wrong("no clock offset puts three or more fixes into the time of the run; is it the track of this drive?".into())
    })?;
    let prior_s = known.map_or_else(|| uniform_sigma_s(&trajectory, &fixes), |clock| clock.sigma_s);
    let result = deviations::with_deviations(&trajectory, (&fixes, &origin), &best, prior_s, options);
    let heading_sigma = result.anchor.sigma.map_or(f64::INFINITY, |(_, heading)| heading);
    if heading_sigma.is_nan() || heading_sigma > options.most_heading_sigma_deg {
        return Err(wrong(format!(
            "the fixes do not determine the heading of this drive (standard deviation {heading_sigma:.0} degrees): it is short, or bends \
             at constant speed, which a clock offset explains as well; give the clock offset and its standard deviation, or the start \
             and heading"
        )));
    }
    Ok(result)
}

fn fix(origin: &Geodetic, point: &TrackPoint) -> Fix {
    let local = origin.local(&point.at);
    Fix { time_s: point.time_s, at: local.xy(), up: local.z, sigma: point.sigma_m }
}

fn trajectory(run: &RecordedRun) -> Option<LevelTrajectory> {
    let (axes, first) = (level_axes(run)?, run.frames.first()?);
    let origin = first.world_from_camera.translation();
    Some(LevelTrajectory {
        times_s: run.frames.iter().map(|f| f.timestamp_ns as f64 * 1e-9).collect(),
        at: run.frames.iter().map(|f| axes * (f.world_from_camera.translation() - origin)).collect(),
    })
}

impl LevelTrajectory {
    /// Position at a time, between frames by interpolation.
    fn at(&self, time_s: f64) -> Option<Vector3<f64>> {
        let after = self.times_s.partition_point(|t| *t < time_s);
        if after == 0 {
            return (self.times_s.first() == Some(&time_s)).then(|| self.at[0]);
        }
        let (t0, t1) = (self.times_s[after - 1], *self.times_s.get(after)?);
        let share = (time_s - t0) / (t1 - t0);
        Some(self.at[after - 1].lerp(&self.at[after], share))
    }
}

/// The best clock offset: a coarse search, then ever finer ones around its best.
fn search(
    trajectory: &LevelTrajectory,
    fixes: &[Fix],
    known: Option<ClockOffset>,
    options: &AlignOptions,
) -> Option<Fit> {
    let (low, high) = offsets(trajectory, fixes, known)?;
    let mut best: Option<Fit> = None;
    let mut tried: Vec<(f64, f64)> = Vec::new();
    let steps = ((high - low) / options.coarse_s).ceil().max(1.0) as usize;
    let consider = |offset: f64, best: &mut Option<Fit>| {
        let mut fit = fit(trajectory, fixes, offset, options)?;
        if let Some(clock) = known {
            fit.cost += 0.5 * ((offset - clock.offset_s) / clock.sigma_s).powi(2);
        }
        let cost = fit.cost;
        if best.as_ref().is_none_or(|b| cost < b.cost) {
            *best = Some(fit);
        }
        Some(cost)
    };
    for k in 0..=steps {
        let offset = low + k as f64 * options.coarse_s;
        tried.extend(consider(offset, &mut best).map(|cost| (offset, cost)));
    }
    let mut step = options.coarse_s;
    while step > 1e-3 {
        step *= 0.5;
        let middle = best.as_ref()?.offset_s;
        consider(middle - step, &mut best);
        consider(middle + step, &mut best);
    }
    let mut best = best?;
    best.offset_sigma_s = spread_s(&best, &tried);
    Some(best)
}

/// Standard deviation of the offset about the best one, each that was tried weighing as probable as it is: there may be several that fit.
fn spread_s(best: &Fit, tried: &[(f64, f64)]) -> f64 {
    let weighed = tried.iter().map(|(offset_s, cost)| ((best.cost - cost).exp(), offset_s - best.offset_s));
    let (sum, squares) =
        weighed.fold((0.0, 0.0), |(sum, squares), (w, off)| (sum + w, squares + w * off * off));
    if sum > 0.0 { (squares / sum).sqrt() } else { 0.0 }
}

/// Clock offsets that are possible.
fn offsets(trajectory: &LevelTrajectory, fixes: &[Fix], known: Option<ClockOffset>) -> Option<(f64, f64)> {
    let (start, end) = (*trajectory.times_s.first()?, *trajectory.times_s.last()?);
    let (first, last) = (fixes.first()?.time_s, fixes.last()?.time_s);
    let half = 0.5 * (end - start);
    Some(match known {
        Some(clock) => (clock.offset_s - 3.0 * clock.sigma_s, clock.offset_s + 3.0 * clock.sigma_s),
        None => (first - start - half, last - end + half),
    })
}

/// Heading and shift at a clock offset by iteratively reweighted least squares (Cauchy); `None` with fewer than three fixes, or
/// with so few that most of the run has none.
fn fit(trajectory: &LevelTrajectory, fixes: &[Fix], offset_s: f64, options: &AlignOptions) -> Option<Fit> {
    let pairs: Vec<(usize, Vector2<f64>)> = fixes
        .iter()
        .enumerate()
        .filter_map(|(k, fix)| Some((k, trajectory.at(fix.time_s - offset_s)?.xy())))
        .collect();
    let [(first, _), .., (last, _)] = pairs[..] else { return None };
    let covered = fixes[last].time_s - fixes[first].time_s;
    let whole = trajectory.times_s.last()? - trajectory.times_s.first()?;
    if pairs.len() < 3 || covered < options.least_covered * whole {
        return None;
    }
    let mut weights: Vec<f64> = pairs.iter().map(|(k, _)| fixes[*k].sigma.powi(-2)).collect();
    let (mut heading, mut shift) = (0.0, Vector2::zeros());
    let kernel = options.kernel_sigmas.powi(2);
    let residual = |heading: f64, shift: &Vector2<f64>, k: usize, p: &Vector2<f64>| {
        (fixes[k].at - turned(p, heading) - shift).norm() / fixes[k].sigma
    };
    for _ in 0..options.iterations {
        let sum: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(usize) -> Vector2<f64>| {
            (0..pairs.len()).fold(Vector2::zeros(), |m, k| m + of(k) * weights[k]) / sum
        };
        let (p0, q0) = (mean(&|k| pairs[k].1), mean(&|k| fixes[pairs[k].0].at));
        let (mut dot, mut cross) = (0.0, 0.0);
        for ((k, p), w) in pairs.iter().zip(&weights) {
            let (p, q) = (p - p0, fixes[*k].at - q0);
            dot += w * (q.x * p.x + q.y * p.y);
            cross += w * (q.x * p.y - q.y * p.x);
        }
        heading = cross.atan2(dot);
        shift = q0 - turned(&p0, heading);
        for ((k, p), w) in pairs.iter().zip(&mut weights) {
            *w = fixes[*k].sigma.powi(-2) / (1.0 + residual(heading, &shift, *k, p).powi(2) / kernel);
        }
    }
    let costs = pairs.iter().map(|(k, p)| (residual(heading, &shift, *k, p).powi(2) / kernel).ln_1p());
    let used: Vec<usize> = pairs.iter().map(|(k, _)| *k).collect();
    // Fixes outside of the run cost as much as fixes that fit: fewer of them are neither a gain nor a loss.
    let interval_s = covered / (pairs.len() - 1) as f64;
    let expected = (whole / interval_s + 1.0).max(pairs.len() as f64);
    let fitting = (expected - pairs.len() as f64) * COST_OF_A_FIX;
    let independent = (whole / options.correlated_s + 1.0).min(expected);
    // A receiver mostly runs for as long as the camera: one run in ten has no fixes for a correlation time.
    let (started, ended) = (trajectory.times_s.first()? + offset_s, trajectory.times_s.last()? + offset_s);
    let missing_s = |without_s: f64| (without_s - interval_s).max(0.0);
    let without_s = missing_s(fixes[first].time_s - started) + missing_s(ended - fixes[last].time_s);
    let without = without_s / options.correlated_s * std::f64::consts::LN_10;
    // Cauchy's kernel as a negative logarithm of a likelihood, of so many fixes as are independent.
    let cost = 2.0 * ((costs.sum::<f64>() + fitting) * independent / expected + without);
    Some(Fit { offset_s, heading, shift, cost, weights, used, offset_sigma_s: 0.0 })
}

/// Standard deviation of a clock that could have any possible offset \[s\].
fn uniform_sigma_s(trajectory: &LevelTrajectory, fixes: &[Fix]) -> f64 {
    offsets(trajectory, fixes, None).map_or(0.0, |(low, high)| (high - low) / 12_f64.sqrt())
}

/// Number of independent fixes among these.
fn independent(fixes: &[Fix], used: &[usize], options: &AlignOptions) -> f64 {
    let [first, .., last] = used else { return used.len() as f64 };
    ((fixes[*last].time_s - fixes[*first].time_s) / options.correlated_s + 1.0).min(used.len() as f64)
}

/// Right and forward turned into east and north.
fn turned(p: &Vector2<f64>, heading: f64) -> Vector2<f64> {
    let (sin, cos) = heading.sin_cos();
    Vector2::new(p.x * cos + p.y * sin, -p.x * sin + p.y * cos)
}

#[cfg(test)]
mod tests;
