//! `motorcade demo`: renders a drive, runs everything on it, evaluates, writes the report.

use std::path::{Path, PathBuf};

use motorcade::{
    Config, External, KeypointTable, Motorcade, Progress, RunContext, output, push_sequence, write_run,
};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_perception::{Perception, PerceptionOptions};
use motorcade_simulate::{KeypointOptions, RenderOptions, WriteOptions};

use crate::arguments::DemoArguments;
use crate::evaluation::evaluate_result;
use crate::exit;
use crate::progress::Reporter;
use crate::run::code;
use crate::simulate;
use crate::threads::threads;

/// Scenario of the demo.
const SCENARIO: &str = "demo";

/// Runs the demo.
pub fn demo(arguments: &DemoArguments) -> anyhow::Result<u8> {
    // An earlier demo in the same place is replaced; anything else is left alone.
    output::prepare(&arguments.out, true)?;
    let drive = beside(&arguments.out);
    let reporter = Reporter::new(arguments.progress);
    let planned = simulate::built_in(SCENARIO, arguments.frames, arguments.seed, &RenderOptions::default())?;
    reporter.begin("rendering", Some(planned.len()));
    let wanted = WriteOptions { keypoints: Some(KeypointOptions::default()), ..Default::default() };
    let written = planned.write_kitti(&drive, &wanted, &|done| reporter.advance(done))?;
    let options =
        SequenceOptions { sequence: Some(written.sequence.clone()), camera: Some(2), ..Default::default() };
    let sequence = Sequence::open(&written.training, &options)?;
    let perception = PerceptionOptions {
        detections: Some(written.detections.clone()),
        road_masks: written.road_masks.clone(),
        ..Default::default()
    };
    let perception = Perception::open(&perception, sequence.size())?;
    let config = Config::default();
    let context = RunContext {
        config,
        camera_from_cam0: sequence.camera_from_cam0(),
        input: sequence.summary(),
        perception: perception.describe(),
        command: std::env::args().collect(),
        fingerprint: String::new(),
    };
    let threads = threads(arguments.threads);
    let keypoints = written.keypoints.as_deref().map(KeypointTable::read).transpose()?;
    let mut slam = Motorcade::builder(sequence.camera()?)
        .height_m(sequence.height_m(None)?)
        .config(config)
        .external(External { keypoints, ..External::default() })
        .perception(perception)
        .threads(threads)
        .build()?;
    push_sequence(&mut slam, &sequence, threads, &reporter, &mut |_| ())?;
    let result = slam.finish_with(&reporter);
    reporter.finish();
    let evaluation = evaluate_result(&result, &context, &written.training)?;
    let extras = [
        extra("report.html", motorcade_viewer::report(&result, &context, Some(&evaluation))),
        extra("evaluation.json", serde_json::to_string_pretty(&evaluation)?),
    ];
    write_run(&arguments.out, &result, &context, &extras)?;
    exit::print(evaluation.to_string().trim_end());
    exit::print(&format!(
        "\ndrive   {}\nreport  {}",
        drive.display(),
        arguments.out.join("report.html").display()
    ));
    Ok(code(&result, &config))
}

fn extra(name: &str, content: String) -> output::Extra {
    output::Extra { name: name.to_owned(), content: content.into_bytes() }
}

/// `runs/demo` → `runs/demo-drive`.
fn beside(out: &Path) -> PathBuf {
    let name = out.file_name().map_or_else(|| "demo".to_owned(), |n| n.to_string_lossy().into_owned());
    out.with_file_name(format!("{name}-drive"))
}
