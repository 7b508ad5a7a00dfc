//! The frames that a run was made from.

use std::path::PathBuf;

use clap::Parser;
use motorcade::{RecordedRun, RunRecord};
use motorcade_dataset::{FrameRange, Sequence, SequenceOptions};

use crate::arguments::{Cli, Command, DrawArguments};
use crate::drive::CAMERA_FILE;
use crate::files::demo_drive;

/// Place of the frames of a run: the input that is asked for, or that of the run's command.
pub fn place(record: &RunRecord, arguments: &DrawArguments) -> Option<PathBuf> {
    arguments.input.clone().or_else(|| recorded(record)?.0)
}

/// Opens the frames of a run: those of its own selection that lie in the range asked for.
///
/// # Errors
/// An input that is not there or not named, and frames of another camera than the run's.
pub fn open(record: &RunRecord, run: &RecordedRun, arguments: &DrawArguments) -> anyhow::Result<Sequence> {
    let directory = arguments.run.display();
    let mut options = recorded(record).map(|(_, options)| options).unwrap_or_default();
    let Some(path) = place(record, arguments) else {
        let problem = "its run.json does not name the input; give it after the run's directory";
        return Err(motorcade::Error::Config(format!("{directory}: {problem}")).into());
    };
    if arguments.input.is_none() && !path.exists() {
        let problem = format!("{} is not there", path.display());
        let advice = "give its place after the run's directory: motorcade draw RUN INPUT";
        return Err(motorcade::Error::Input(format!("the input of {directory}, {problem}; {advice}")).into());
    }
    // As the run recognised them; what it ignored is drawn on all the same.
    let input = &record.input;
    options.format = input.format.or(options.format);
    options.sequence = input.sequence.clone().or(options.sequence);
    options.camera = input.camera.or(options.camera);
    if options.uncalibrated {
        options.calibration = Some(arguments.run.join(CAMERA_FILE));
        options.uncalibrated = false;
    }
    options.calibration = arguments.calibration.clone().or(options.calibration);
    options.ignore = None;
    options.frames = selected(run, &arguments.frames).ok_or_else(|| {
        motorcade::Error::Config(format!("no frame of {directory} lies in {}", arguments.frames))
    })?;
    let sequence = Sequence::open(&path, &options)?;
    check(record, &sequence).map_err(|problem| {
        motorcade::Error::Input(format!("{}: {problem}, not those of {directory}", path.display()))
    })?;
    Ok(sequence)
}

/// Path and options of the input of the run's command.
fn recorded(record: &RunRecord) -> Option<(Option<PathBuf>, SequenceOptions)> {
    match Cli::try_parse_from(&record.command).ok()?.command {
        Command::Run(run) => Some((Some(run.input.input.clone()), run.input.options())),
        Command::Demo(demo) => {
            Some((Some(demo_drive(&demo.out).join("training")), SequenceOptions::default()))
        }
        _ => None,
    }
}

/// From the first to the last frame of the run in a range: a stride then meets the same frames as in the run.
fn selected(run: &RecordedRun, range: &FrameRange) -> Option<FrameRange> {
    let mut numbers = run.frames.iter().map(|f| f.number).filter(|number| range.contains(*number));
    let start = numbers.next()?;
    Some(FrameRange { start: Some(start), end: numbers.next_back().unwrap_or(start).checked_add(1) })
}

/// Compares size and intrinsics with those the run recorded.
fn check(record: &RunRecord, sequence: &Sequence) -> Result<(), String> {
    let input = &record.input;
    let (width, height) = sequence.size();
    if let (Some(w), Some(h)) = (input.width, input.height)
        && (w, h) != (width, height)
    {
        return Err(format!("its frames are {width}x{height}, not {w}x{h}"));
    }
    let camera = sequence.camera().map_err(|e| e.to_string())?;
    let found = [camera.fx, camera.fy, camera.cx, camera.cy];
    let same = |recorded: &[f64; 4]| found.iter().zip(recorded).all(|(a, b)| (a - b).abs() <= 1e-3);
    if input.intrinsics_px.is_some_and(|recorded| !same(&recorded)) {
        return Err(format!("its intrinsics are {found:?}"));
    }
    Ok(())
}
