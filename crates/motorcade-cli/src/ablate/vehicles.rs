//! Cues of a vehicle's position alone, left out and together, and other networks.

use std::fmt::Write;
use std::path::Path;

use motorcade::{Config, FrontEndRecord, Progress, Settings, estimate_drive};
use motorcade_evaluate::{Report, VehicleMeans};

use super::table::cell;
use super::{Ablation, Truth, cues};
use crate::arguments::{RunArguments, VehiclesAblateArguments};
use crate::evaluation::evaluate_result;
use crate::run::overlaid;

/// Errors of one variant.
struct VehicleRow {
    name: String,
    report: Report,
}

/// Runs the suite, prints its table and writes it.
pub fn vehicles(arguments: &VehiclesAblateArguments) -> anyhow::Result<u8> {
    let VehiclesAblateArguments { run, kitti, compare_models } = arguments;
    let truth = Truth { kitti: Some(kitti), camera: None };
    let mut ablation = Ablation::open(run, truth)?;
    // The front end is that of the default in all rows: the camera is the same, and the boxes are.
    let (record, base) = ablation.front_end(&overlaid(Config::default(), run)?)?;
    let mut rows = Vec::new();
    for variant in cues::variants() {
        if record.interrupted || Progress::cancelled(&ablation.reporter) {
            break;
        }
        let settings = Settings { config: ablation.config(&variant)?, ..base.clone() };
        rows.push(row(&ablation, variant.name, kitti, (&record, &settings))?);
    }
    for folder in compare_models {
        if Progress::cancelled(&ablation.reporter) {
            break;
        }
        rows.extend(with_networks(run, folder, truth, kitti)?);
    }
    ablation.write_tables(&table(&rows), &csv(&rows))
}

/// The default with the networks of a folder; `None` when it was interrupted.
fn with_networks(
    run: &RunArguments,
    folder: &Path,
    truth: Truth<'_>,
    kitti: &Path,
) -> anyhow::Result<Option<VehicleRow>> {
    let run = RunArguments { models: Some(folder.to_path_buf()), perception: None, ..run.clone() };
    let mut ablation = Ablation::open(&run, truth)?;
    let (record, settings) = ablation.front_end(&overlaid(Config::default(), &run)?)?;
    if record.interrupted {
        return Ok(None);
    }
    let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
    row(&ablation, format!("default, networks of {name}"), kitti, (&record, &settings)).map(Some)
}

fn row(
    ablation: &Ablation<'_>,
    name: String,
    kitti: &Path,
    (record, settings): (&FrontEndRecord, &Settings),
) -> anyhow::Result<VehicleRow> {
    let result = estimate_drive(record.clone(), settings, &ablation.reporter);
    let context = ablation.drive.context(settings.config, String::new());
    let report = evaluate_result(&result, &context, kitti)?;
    tracing::info!("{name}: {} vehicles", result.vehicles.len());
    Ok(VehicleRow { name, report })
}

/// Name and digits of each number of a row.
const COLUMNS: [(&str, usize); 12] = [
    ("labelled vehicles", 0),
    ("matched", 0),
    ("coverage %", 0),
    ("depth error within 40 m: median %", 1),
    ("90 % of frames %", 1),
    ("depth below 2σ %", 0),
    ("heading error: median °", 1),
    ("reversed %", 1),
    ("AP3D moderate 0.5 %", 1),
    ("0.7 %", 1),
    ("HOTA %", 1),
    ("ATE first pose m", 2),
];

impl VehicleRow {
    /// Numbers in the order of [`COLUMNS`].
    fn numbers(&self) -> [Option<f64>; 12] {
        let Report { vehicles, vehicles_mean, vehicles_consistency, boxes3d, tracking2d, .. } = &self.report;
        let vehicles = vehicles.as_deref().unwrap_or_default();
        let matched = vehicles.iter().filter(|v| v.coverage > 0.0).count();
        let mean = |of: fn(&VehicleMeans) -> Option<f64>| vehicles_mean.as_ref().and_then(of);
        [
            Some(vehicles.len() as f64),
            Some(matched as f64),
            mean(|m| Some(100.0 * m.coverage)),
            mean(|m| m.depth_error_pct_median),
            mean(|m| m.depth_error_pct_p90),
            vehicles_consistency.map(|c| 100.0 * c.depth.within_two_sigma),
            mean(|m| m.heading_error_deg_median),
            mean(|m| Some(100.0 * m.reversed_share)),
            boxes3d.map(|b| b.ap3d_50.moderate),
            boxes3d.map(|b| b.ap3d_70.moderate),
            tracking2d.map(|t| t.hota),
            mean(|m| Some(m.ate_origin_m)),
        ]
    }
}

fn table(rows: &[VehicleRow]) -> String {
    let mut out = String::from("| variant |");
    COLUMNS.iter().for_each(|(name, _)| out.extend([" ", name, " |"]));
    out.push_str("\n|---|");
    out.push_str(&"---|".repeat(COLUMNS.len()));
    out.push('\n');
    for row in rows {
        let _ = write!(out, "| {} |", row.name);
        for (number, (_, digits)) in row.numbers().into_iter().zip(COLUMNS) {
            let _ = write!(out, " {} |", cell(number, digits));
        }
        out.push('\n');
    }
    out
}

fn csv(rows: &[VehicleRow]) -> String {
    let mut out = String::from(
        "variant,labelled,matched,coverage_pct,depth_error_pct_median,depth_error_pct_p90,depth_within_two_sigma_pct,heading_error_deg_median,\
         reversed_pct,ap3d_50_moderate_pct,ap3d_70_moderate_pct,hota_pct,ate_first_pose_m\n",
    );
    for row in rows {
        let number = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.6}"));
        let numbers = row.numbers().map(number).join(",");
        let _ = writeln!(out, "{},{numbers}", row.name.replace(',', ";"));
    }
    out
}
