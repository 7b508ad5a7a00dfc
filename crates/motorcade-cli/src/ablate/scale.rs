//! Metres by road, points, vehicles and speed, each alone and together.

use std::fmt::Write;

use motorcade::{Config, DistanceSensor, Progress, RunResult, Settings, estimate_drive};
use motorcade_dataset::Error;
use motorcade_evaluate::EgoReport;

use super::sources::{RoadUse, Sources};
use super::suites::Variant;
use super::table::cell;
use super::{Ablation, Truth};
use crate::arguments::{CameraHeight, ScaleAblateArguments};
use crate::run::overlaid;

/// Estimates and errors of one variant.
struct ScaleRow {
    name: String,
    height_m: f64,
    /// Length of the way \[m\].
    length_m: f64,
    /// Relative standard deviation of scale, a mean over the frames.
    sigma: f64,
    /// Share of the frames with a scale of their own.
    measured: f64,
    true_length_m: Option<f64>,
    ego: Option<EgoReport>,
}

impl ScaleRow {
    fn new(name: String, result: &RunResult, true_length_m: Option<f64>, ego: Option<EgoReport>) -> Self {
        let frames = &result.ego.frames;
        let count = frames.len().max(1) as f64;
        Self {
            name,
            height_m: result.ego.height_m,
            length_m: result.ego.length_m(),
            sigma: frames.iter().map(|f| f.scale_sigma.hypot(f.scale_bias_sigma)).sum::<f64>() / count,
            measured: frames.iter().filter(|f| f.scale_measured).count() as f64 / count,
            true_length_m: ego.as_ref().map(|e| e.length_m).or(true_length_m),
            ego,
        }
    }

    /// Relative error of the length of the way.
    fn length_error(&self) -> Option<f64> {
        self.true_length_m.map(|length_m| self.length_m / length_m - 1.0)
    }

    /// Relative error of scale: that of the similarity that aligns the trajectory best, or else that of the length.
    fn scale_error(&self) -> Option<f64> {
        let best =
            self.ego.as_ref().and_then(|e| e.best_scale).map(|true_over_own| 1.0 / true_over_own - 1.0);
        best.or_else(|| self.length_error())
    }

    /// The same in standard deviations, of logarithms: scales are positive.
    fn sigmas(&self) -> Option<f64> {
        self.scale_error().map(|error| error.ln_1p().abs() / self.sigma)
    }
}

/// Runs the suite, prints its table and writes it.
pub fn scale(arguments: &ScaleAblateArguments) -> anyhow::Result<u8> {
    let ScaleAblateArguments { run, kitti, ground_truth, distance } = arguments;
    if run.height == Some(CameraHeight::Auto) {
        anyhow::bail!(Error::Usage(
            "ablate scale compares the stated height with other sources: give --height in metres".into()
        ));
    }
    let base = overlaid(Config::default(), run)?;
    let truth = Truth { kitti: kitti.as_deref(), camera: ground_truth.as_deref() };
    let mut ablation = Ablation::open(run, truth)?;
    let mut rows: Vec<Option<ScaleRow>> = Vec::new();
    for road in RoadUse::ALL {
        let (record, settings) = ablation.front_end(&road.configure(base))?;
        if record.interrupted {
            break;
        }
        let sensor = settings.external.distances.as_ref().map(|d| d.sensor);
        let variants = Sources::all(sensor.is_some());
        rows.resize_with(variants.len(), || None);
        for (sources, row) in variants.iter().zip(&mut rows).filter(|(s, _)| s.road_use() == road) {
            if Progress::cancelled(&ablation.reporter) {
                break;
            }
            let settings = sources.apply(settings.clone());
            let result = estimate_drive(record.clone(), &settings, &ablation.reporter);
            let name = sources.name(if sensor == Some(DistanceSensor::Gps) { "GPS" } else { "speed" });
            let ego = errors(&ablation, &name, &settings, &result)?;
            *row = Some(ScaleRow::new(name, &result, *distance, ego));
        }
    }
    let rows: Vec<ScaleRow> = rows.into_iter().flatten().collect();
    ablation.write_tables(&table(&rows), &csv(&rows))
}

/// Errors of the camera, where its true trajectory is known.
fn errors(
    ablation: &Ablation<'_>,
    name: &str,
    settings: &Settings,
    result: &RunResult,
) -> anyhow::Result<Option<EgoReport>> {
    let Truth { kitti, camera } = ablation.truth;
    if kitti.or(camera).is_none() {
        return Ok(None);
    }
    let variant = Variant { name: name.to_owned(), preset: settings.config.preset, set: Vec::new() };
    Ok(Some(ablation.row(&variant, &settings.config, result)?.ego))
}

fn table(rows: &[ScaleRow]) -> String {
    let mut out = String::from(
        "| sources | height m | way m | sigma % | frames measured % | scale error % | in sigmas | distance error % | ATE SE(3) m | \
         scale error ±5 frames: median % | 95 % |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let percent = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{:+.1}", 100.0 * v));
    for row in rows {
        let ego = row.ego.as_ref();
        let _ = writeln!(
            out,
            "| {} | {:.2} | {:.1} | {:.1} | {:.0} | {} | {} | {} | {} | {} | {} |",
            row.name,
            row.height_m,
            row.length_m,
            100.0 * row.sigma,
            100.0 * row.measured,
            percent(row.scale_error()),
            cell(row.sigmas(), 1),
            percent(row.length_error()),
            cell(ego.map(|e| e.ate_se3_m), 2),
            cell(ego.and_then(|e| e.scale_window_pct_median), 2),
            cell(ego.and_then(|e| e.scale_window_pct_p95), 2),
        );
    }
    out
}

fn csv(rows: &[ScaleRow]) -> String {
    let mut out = String::from(
        "sources,height_m,length_m,scale_sigma_rel,measured_share,scale_error_rel,scale_error_sigmas,length_error_rel,ate_se3_m\n",
    );
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.6}"));
    for row in rows {
        let _ = writeln!(
            out,
            "{},{:.6},{:.6},{:.6},{:.6},{},{},{},{}",
            row.name,
            row.height_m,
            row.length_m,
            row.sigma,
            row.measured,
            number(row.scale_error()),
            number(row.sigmas()),
            number(row.length_error()),
            number(row.ego.as_ref().map(|e| e.ate_se3_m)),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_and_in_sigmas() {
        let row = ScaleRow {
            name: "road".to_owned(),
            height_m: 1.5,
            length_m: 110.0,
            sigma: 0.05,
            measured: 1.0,
            true_length_m: Some(100.0),
            ego: None,
        };
        assert!((row.length_error().unwrap() - 0.1).abs() < 1e-12);
        assert!((row.sigmas().unwrap() - 1.1_f64.ln() / 0.05).abs() < 1e-12);
        assert!(table(&[row]).contains("| road | 1.50 | 110.0 | 5.0 | 100 | +10.0 | 1.9 | +10.0 | – |"));
    }
}
