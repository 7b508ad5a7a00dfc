//! `motorcade run`.

use anyhow::Context;
use motorcade::{Config, Preset, RunContext, RunResult, output, write_run};
use motorcade_dataset::Sequence;
use motorcade_perception::{ModelOptions, Perception, PerceptionOptions};

use crate::arguments::{PresetName, RunArguments};
use crate::exit;
use crate::fingerprint::{already_done, fingerprint};
use crate::progress::Reporter;

/// Runs the pipeline and writes its directory.
pub fn run(arguments: &RunArguments) -> anyhow::Result<u8> {
    let config = configuration(arguments)?;
    let sequence = Sequence::open(&arguments.input.input, &arguments.input.options())?;
    let height_m = sequence.height_m(arguments.height)?;
    let fingerprint = fingerprint(arguments, &sequence, height_m, &config);
    if !arguments.force && already_done(&arguments.out, &fingerprint) {
        exit::print(&format!("{} already holds this run; --force repeats it", arguments.out.display()));
        return Ok(exit::FINE);
    }
    output::prepare(&arguments.out, arguments.force)?;
    // Asked for before the first network is loaded: without it nothing can run.
    sequence.camera()?;
    let perception = Perception::open(&perception_options(arguments), sequence.size())?;
    let reporter = Reporter::new(arguments.progress);
    let threads = threads(arguments.threads);
    let result = motorcade::run(&sequence, &perception, height_m, &config, threads, &reporter)?;
    reporter.finish();
    let context = RunContext {
        config,
        camera_from_cam0: sequence.camera_from_cam0(),
        input: sequence.summary(),
        perception: perception.describe(),
        command: std::env::args().collect(),
        fingerprint,
    };
    let report = motorcade_viewer::report(&result, &context, None).into_bytes();
    let extras = [output::Extra { name: "report.html".into(), content: report }];
    write_run(&arguments.out, &result, &context, &extras)?;
    exit::print(&summary(&result, arguments));
    Ok(code(&result, &config))
}

/// 130 when interrupted, 4 when too many frames were not tracked, else 0; results are written in every case.
pub fn code(result: &RunResult, config: &Config) -> u8 {
    if result.interrupted {
        exit::INTERRUPTED
    } else if 1.0 - result.tracked_share() > config.run.most_untracked {
        exit::TRACKING_FAILED
    } else {
        exit::FINE
    }
}

fn configuration(arguments: &RunArguments) -> anyhow::Result<Config> {
    let preset = match arguments.preset {
        PresetName::Default => Preset::Default,
        PresetName::Paper => Preset::Paper,
    };
    let mut config = Config::preset(preset);
    if let Some(path) = &arguments.config {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        config = config.overlay(&text, &path.display().to_string())?;
    }
    for assignment in &arguments.set {
        config = config.set(assignment)?;
    }
    Ok(config)
}

fn perception_options(arguments: &RunArguments) -> PerceptionOptions {
    PerceptionOptions {
        models: arguments.models.clone(),
        detections: arguments.detections.clone(),
        road_masks: arguments.road_masks.clone(),
        networks: ModelOptions::default(),
    }
}

fn threads(asked: usize) -> usize {
    if asked > 0 { asked } else { std::thread::available_parallelism().map_or(1, std::num::NonZero::get) }
}

fn summary(result: &RunResult, arguments: &RunArguments) -> String {
    let times = result.stopwatch.summary();
    let spent: f64 = times.values().map(|t| t.total_s).sum();
    let moving = result.vehicles.iter().filter(|v| v.p_moving > 0.5).count();
    let vehicles = if result.looked_for_vehicles {
        format!("{} vehicles ({moving} moving)", result.vehicles.len())
    } else {
        "no vehicles looked for".to_owned()
    };
    format!(
        "{} frames, {:.1} m driven, {:.1} % tracked, {vehicles}, {spent:.1} s of computing\n{}",
        result.frames.len(),
        result.ego.length_m(),
        100.0 * result.tracked_share(),
        arguments.out.display()
    )
}
