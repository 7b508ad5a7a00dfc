//! `motorcade evaluate`.

use std::path::Path;

use motorcade_dataset::regular_file;
use motorcade_evaluate::evaluate_run;

use crate::arguments::EvaluateArguments;
use crate::exit;
use crate::files::OutFile;

/// Compares a run with ground truth: a table on stdout, JSON where asked.
pub fn evaluate(arguments: &EvaluateArguments) -> anyhow::Result<u8> {
    let run = &arguments.run;
    let record = record(run);
    warn_of_another(&record, arguments);
    let input = &record["input"];
    let recorded = input["sequence"].as_str().map(str::to_owned);
    let Some(sequence) = arguments.sequence.clone().or(recorded) else {
        let problem = "its run.json names no KITTI sequence; give --sequence";
        return Err(motorcade::Error::Config(format!("{}: {problem}", run.display())).into());
    };
    let recorded = input["camera"].as_u64().and_then(|camera| u8::try_from(camera).ok());
    let camera = arguments.camera.or(recorded).unwrap_or(2);
    let first = arguments.first.or_else(|| first_in_table(run)).or_else(|| input["numbers"][0].as_u64());
    let json = OutFile::create_optional(arguments.json.as_deref())?;
    let report = evaluate_run(run, &arguments.kitti, &sequence, camera, first.unwrap_or(0))?;
    if let Some(file) = json {
        file.write(&(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    exit::print(report.to_string().trim_end())?;
    Ok(exit::FINE)
}

/// `run.json`; null where there is none: trajectories of other programs are evaluated too.
fn record(run: &Path) -> serde_json::Value {
    regular_file::read_to_string(&run.join("run.json"))
        .ok()
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or_default()
}

/// Number of the first frame in `frames.csv`.
fn first_in_table(run: &Path) -> Option<u64> {
    let text = regular_file::read_to_string(&run.join("frames.csv")).ok()?;
    text.lines().nth(1)?.split(',').next()?.parse().ok()
}

/// The errors of a run against another drive are large and mean nothing.
fn warn_of_another(record: &serde_json::Value, arguments: &EvaluateArguments) {
    let input = &record["input"];
    if let (Some(made), Some(asked)) = (input["sequence"].as_str(), &arguments.sequence)
        && made != asked
    {
        exit::eprint(&format!("warning: the run is of sequence {made}, compared with {asked}"));
    }
    if let (Some(made), Some(asked)) = (input["camera"].as_u64(), arguments.camera)
        && made != u64::from(asked)
    {
        exit::eprint(&format!("warning: the run is of camera {made}, compared with camera {asked}"));
    }
}
