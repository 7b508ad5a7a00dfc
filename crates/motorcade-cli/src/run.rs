//! `motorcade run`.

use std::path::Path;

use anyhow::Context;
use motorcade::output::{Extra, OutputDirectory, RUN_RECORD};
use motorcade::{Config, Motorcade, Preset, RunContext, RunResult, write_run};
use motorcade_dataset::regular_file;

use crate::arguments::{ConfigArguments, PresetName, RunArguments};
use crate::drive::Drive;
use crate::exit;
use crate::fingerprint::{already_done, fingerprint};
use crate::progress::Reporter;

/// Runs the pipeline and writes its directory.
pub fn run(arguments: &RunArguments) -> anyhow::Result<u8> {
    let config = configuration(arguments)?;
    let drive = Drive::open(arguments)?;
    let fingerprint = fingerprint(arguments, &drive.summary().input_hash, drive.height_m, &config);
    if finished_before(arguments, &fingerprint) {
        return Ok(exit::FINE);
    }
    let directory = OutputDirectory::open(&arguments.out, RUN_RECORD, arguments.force)?;
    let mut drive = drive.load(arguments)?;
    let reporter = Reporter::new(arguments.progress);
    let mut slam = drive.slam(&config)?;
    let result = if config.online.enabled {
        drive.push_all(&mut slam, &reporter, &mut |slam| print_estimate(slam, &reporter))?;
        slam.finish_online(&reporter)
    } else {
        drive.survey(&mut slam, &reporter);
        drive.push_all(&mut slam, &reporter, &mut |_| ())?;
        slam.finish_with(&reporter)
    };
    reporter.finish();
    let context = drive.context(config, fingerprint);
    let code = write(&directory, arguments, &result, &context, drive.kept())?;
    // After the results are safe: a frame that stdout did not take is an error of an online run.
    reporter.printed()?;
    Ok(code)
}

/// The newest frame as a line on stdout.
fn print_estimate(slam: &mut Motorcade, reporter: &Reporter) {
    if let Some(estimate) = slam.estimate() {
        reporter.print(&estimate.to_json());
    }
}

/// True, and said, when --out holds this very run already.
fn finished_before(arguments: &RunArguments, fingerprint: &str) -> bool {
    let done = !arguments.force && already_done(&arguments.out, fingerprint);
    if done {
        exit::say(&format!("{} already holds this run; --force repeats it", arguments.out.display()));
    }
    done
}

/// Writes the results and says where they are.
fn write(
    directory: &OutputDirectory,
    arguments: &RunArguments,
    result: &RunResult,
    context: &RunContext,
    kept: Option<Extra>,
) -> anyhow::Result<u8> {
    let report = motorcade_viewer::report(result, context, None).into_bytes();
    let mut extras = vec![Extra { name: "report.html".into(), content: report }];
    extras.extend(kept);
    write_run(directory, result, context, &extras)?;
    let summary = summary(result, arguments);
    // Stdout then holds a JSON object a line.
    if context.config.online.enabled {
        exit::eprint(&summary);
    } else {
        exit::say(&summary);
    }
    Ok(code(result, &context.config))
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

/// Preset, file and single settings, in that order.
pub fn configuration(arguments: &RunArguments) -> anyhow::Result<Config> {
    overlaid(Config::preset(preset(arguments.preset)), arguments)
}

/// `motorcade config`.
pub fn print_configuration(arguments: &ConfigArguments) -> anyhow::Result<u8> {
    let config = with_file(Config::preset(preset(arguments.preset)), arguments.config.as_deref())?;
    let config = arguments.set.iter().try_fold(config, |config, assignment| config.set(assignment))?;
    exit::print(config.to_commented_toml().trim_end())?;
    Ok(exit::FINE)
}

/// A configuration with the file and the settings of the command line over it.
pub fn overlaid(config: Config, arguments: &RunArguments) -> anyhow::Result<Config> {
    let mut config = with_file(config, arguments.config.as_deref())?;
    config.online.enabled |= arguments.online;
    if let Some(seed) = arguments.seed {
        config.run.seed = seed;
    }
    for assignment in &arguments.set {
        config = config.set(assignment)?;
    }
    Ok(config)
}

fn preset(name: PresetName) -> Preset {
    match name {
        PresetName::Default => Preset::Default,
        PresetName::Paper => Preset::Paper,
    }
}

fn with_file(config: Config, path: Option<&Path>) -> anyhow::Result<Config> {
    let Some(path) = path else { return Ok(config) };
    let text =
        regular_file::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(config.overlay(&text, &path.display().to_string())?)
}

fn summary(result: &RunResult, arguments: &RunArguments) -> String {
    let times = result.stopwatch.summary();
    let spent: f64 = times.values().map(|t| t.total_s).sum();
    let moving = result.vehicles.iter().filter(|v| v.p_moving > 0.5).count();
    let vehicles = if result.detects_vehicles {
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
