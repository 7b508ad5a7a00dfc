//! `motorcade evaluate`.

use std::path::Path;

use motorcade::{RecordedInput, RunRecord};
use motorcade_dataset::regular_file;
use motorcade_evaluate::evaluate_run;

use crate::arguments::EvaluateArguments;
use crate::exit;
use crate::files::{Content, OutFile};

/// Compares a run with ground truth: a table on stdout, JSON where asked.
pub fn evaluate(arguments: &EvaluateArguments) -> anyhow::Result<u8> {
    let run = &arguments.run;
    for name in ["run.json", "frames.csv"] {
        let path = run.join(name);
        regular_file::exists(&path).map_err(|source| motorcade_dataset::Error::Io { path, source })?;
    }
    // Trajectories of other programs, which have no record, are evaluated too.
    let record = RunRecord::read(run).unwrap_or_default();
    warn_of_another(&record.input, arguments);
    let input = &record.input;
    let Some(sequence) = arguments.sequence.clone().or(input.sequence.clone()) else {
        let problem = "its run.json names no KITTI sequence; give --sequence";
        return Err(motorcade::Error::Config(format!("{}: {problem}", run.display())).into());
    };
    let camera = arguments.camera.or(input.camera).unwrap_or(2);
    let recorded = input.numbers.map(|(first, _)| first);
    let first = arguments.first.or_else(|| first_in_table(run)).or(recorded);
    let json = OutFile::create_optional(arguments.json.as_deref(), Content::Evaluation)?;
    let report = evaluate_run(run, &arguments.kitti, &sequence, camera, first.unwrap_or(0))?;
    if let Some(file) = json {
        file.write(&(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    exit::print(report.to_string().trim_end())?;
    Ok(exit::FINE)
}

/// Number of the first frame in `frames.csv`.
fn first_in_table(run: &Path) -> Option<u64> {
    let text = regular_file::read_to_string(&run.join("frames.csv")).ok()?;
    text.lines().nth(1)?.split(',').next()?.parse().ok()
}

/// The errors of a run against another drive are large and mean nothing.
fn warn_of_another(input: &RecordedInput, arguments: &EvaluateArguments) {
    if let (Some(made), Some(asked)) = (&input.sequence, &arguments.sequence)
        && made != asked
    {
        exit::eprint(&format!("warning: the run is of sequence {made}, compared with {asked}"));
    }
    if let (Some(made), Some(asked)) = (input.camera, arguments.camera)
        && made != asked
    {
        exit::eprint(&format!("warning: the run is of camera {made}, compared with camera {asked}"));
    }
}
