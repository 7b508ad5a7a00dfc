//! `motorcade demo`: renders a drive, runs everything on it, evaluates, writes the report.

use motorcade::output::{Extra, OutputDirectory, RUN_RECORD};
use motorcade::{Config, Motorcade, RunContext, push_sequence, survey_sequence};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_mcap::Schemas;
use motorcade_perception::{Perception, PerceptionOptions};
use motorcade_simulate::{DRIVE_RECORD, RenderOptions, WriteOptions};
use motorcade_viewer::{Pictures, Report};

use crate::arguments::DemoArguments;
use crate::draw::{self, DrawingTarget, Frames, Results};
use crate::drive::command_line;
use crate::evaluation::evaluate_result;
use crate::exit;
use crate::files::demo_drive;
use crate::progress::Reporter;
use crate::run::{code, focal_length};
use crate::simulate;
use crate::threads::threads;

/// Name of the drawing.
const OVERLAY: &str = "overlay.mp4";
/// Scenario of the demo.
const SCENARIO: &str = "demo";

/// Runs the demo.
pub fn demo(arguments: &DemoArguments) -> anyhow::Result<u8> {
    // An earlier demo in the same place is replaced; anything else is left alone.
    let directory = OutputDirectory::open(&arguments.out, RUN_RECORD, true)?;
    let drive = demo_drive(&arguments.out);
    let drive_directory = OutputDirectory::open(&drive, DRIVE_RECORD, true)?;
    let reporter = Reporter::new(arguments.progress);
    let planned = simulate::built_in(SCENARIO, arguments.frames, arguments.seed, &RenderOptions::default())?;
    let written =
        simulate::rendered(&planned, &drive_directory, &drive, &WriteOptions::default(), &reporter)?;
    let options =
        SequenceOptions { sequence: Some(written.sequence.clone()), camera: Some(2), ..Default::default() };
    let sequence = Sequence::open(&written.training, &options)?;
    // The networks inside the program, on the rendered pixels.
    let perception = Perception::open(&PerceptionOptions::default(), sequence.size())?;
    let config = Config::default();
    let context = RunContext {
        config,
        camera_from_cam0: sequence.camera_from_cam0(),
        input: sequence.summary(),
        perception: perception.describe(),
        command: command_line(),
        fingerprint: None,
    };
    let threads = threads(arguments.threads);
    let mut slam = Motorcade::builder(sequence.camera()?)
        .height_m(sequence.height_m(None)?)
        .config(config)
        .perception(perception)
        .threads(threads)
        .build()?;
    survey_sequence(&mut slam, &sequence, &reporter);
    let mut pictures = Pictures::new(sequence.len());
    push_sequence(&mut slam, &sequence, threads, &reporter, &mut |_, frame| pictures.push(frame))?;
    let result = slam.finish_with(&reporter);
    reporter.finish();
    let evaluation = match evaluate_result(&result, &context, &written.training) {
        Ok(evaluation) => Some(evaluation),
        // The first frames alone may be too few for some errors.
        Err(_) if result.interrupted => None,
        Err(error) => return Err(error),
    };
    let report = Report {
        result: &result,
        context: &context,
        evaluation: evaluation.as_ref(),
        pictures: pictures.taken(),
    };
    let mut extras = vec![extra("report.html", report.html())];
    if let Some(evaluation) = &evaluation {
        extras.push(extra("evaluation.json", serde_json::to_string_pretty(evaluation)?));
    }
    let results = Results {
        directory: &directory,
        out: &arguments.out,
        result: &result,
        context: &context,
        extras: &extras,
    };
    let frames = Frames { sequence: &sequence, threads, schemas: Schemas::default(), reporter: &reporter };
    let drawn = draw::write(&results, vec![DrawingTarget::Inside(OVERLAY.into())], Some(frames))?;
    if let Some(evaluation) = &evaluation {
        exit::say(evaluation.to_string().trim_end());
    }
    exit::say(&focal_length(&result));
    exit::say(&format!(
        "\ndrive   {}\nreport  {}",
        drive.display(),
        arguments.out.join("report.html").display()
    ));
    for path in drawn? {
        exit::say(&format!("overlay {}", path.display()));
    }
    Ok(code(&result, &config))
}

fn extra(name: &str, content: String) -> Extra {
    Extra { name: name.to_owned(), content: content.into_bytes() }
}
