//! `motorcade evaluate`.

use std::path::Path;

use motorcade_evaluate::evaluate_run;

use crate::arguments::EvaluateArguments;
use crate::{exit, files};

/// Compares a run with ground truth: a table on stdout, JSON where asked.
pub fn evaluate(arguments: &EvaluateArguments) -> anyhow::Result<u8> {
    let run = &arguments.run;
    let record = record(run);
    warn_of_another(&record, arguments);
    let first =
        arguments.first.or_else(|| first_in_table(run)).or_else(|| record["input"]["numbers"][0].as_u64());
    let json =
        arguments.json.as_deref().map(|path| files::beside(path).map(|file| (file, path))).transpose()?;
    let report =
        evaluate_run(run, &arguments.kitti, &arguments.sequence, arguments.camera, first.unwrap_or(0))?;
    if let Some((file, path)) = json {
        files::write(file, path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    exit::print(report.to_string().trim_end());
    Ok(exit::FINE)
}

/// `run.json`; null where there is none: trajectories of other programs are evaluated too.
fn record(run: &Path) -> serde_json::Value {
    std::fs::read_to_string(run.join("run.json"))
        .ok()
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or_default()
}

/// Number of the first frame in `frames.csv`.
fn first_in_table(run: &Path) -> Option<u64> {
    let text = std::fs::read_to_string(run.join("frames.csv")).ok()?;
    text.lines().nth(1)?.split(',').next()?.parse().ok()
}

/// The errors of a run against another drive are large and mean nothing.
fn warn_of_another(record: &serde_json::Value, arguments: &EvaluateArguments) {
    let input = &record["input"];
    if let Some(sequence) = input["sequence"].as_str().filter(|s| *s != arguments.sequence) {
        let asked = &arguments.sequence;
        exit::eprint(&format!("warning: the run is of sequence {sequence}, compared with {asked}"));
    }
    if let Some(camera) = input["camera"].as_u64().filter(|c| *c != u64::from(arguments.camera)) {
        let asked = arguments.camera;
        exit::eprint(&format!("warning: the run is of camera {camera}, compared with camera {asked}"));
    }
}
