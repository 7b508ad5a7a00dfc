//! `motorcade run`.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use motorcade::output::{Extra, OutputDirectory, RUN_RECORD};
use motorcade::{Config, Motorcade, Preset, Progress, RunRecord, RunResult};
use motorcade_dataset::{Sequence, regular_file};
use motorcade_viewer::Report;

use crate::arguments::{ConfigArguments, PresetName, RunArguments};
use crate::checkpoint::{self, Opened};
use crate::draw::{self, DrawingTarget, Frames, Results, Rig, Target};
use crate::drive::Drive;
use crate::exit;
use crate::files::{Content, OutFile, all_different};
use crate::fingerprint::{already_done, fingerprint, identity, stopped};
use crate::growing_tracks::GrowingTracks;
use crate::live::LiveView;
use crate::progress::Reporter;
use crate::saved_state::SavedState;
use crate::threads::threads;

/// Runs the pipeline and writes its directory.
pub fn run(arguments: &RunArguments) -> anyhow::Result<u8> {
    let config = configuration(arguments)?;
    let drive = Drive::open(arguments)?;
    let input_hash = drive.summary().input_hash;
    let fingerprint = fingerprint(arguments, &input_hash, drive.height_m, &config);
    let live = drive.sequence().is_some_and(Sequence::is_live);
    if !live && finished_before(arguments, &fingerprint) {
        return draw_finished(arguments, &drive);
    }
    let replace = arguments.force || arguments.resume && stopped(&arguments.out, &fingerprint);
    let directory = OutputDirectory::open(&arguments.out, RUN_RECORD, replace)?;
    all_different(files(arguments))?;
    let places = places(arguments, &drive)?;
    let map_file = OutFile::create_optional(arguments.save_map.as_deref(), Content::Map)?;
    let reporter = Reporter::new(arguments.progress);
    let mut drive = drive.calibrated(arguments, &config, &reporter)?.load(arguments, &config)?;
    let run = identity(arguments, &input_hash, &config, &fingerprint);
    let mut live = LiveView::open(arguments, &drive.camera()?)?;
    // A view that is shown or recorded has all frames.
    let keeps_state = !live.is_open() && drive.keeps_state();
    let checkpoint = drive.save(arguments, run, keeps_state)?;
    let every = Duration::from_secs_f64(config.run.checkpoint_s);
    checkpoint.iter().for_each(|checkpoint| checkpoint.perception.sync_every(every));
    let mut slam = drive.slam(&config)?;
    let mut pictures = drive.pictures();
    let mut saved =
        checkpoint.as_ref().filter(|_| keeps_state).and_then(|c| SavedState::new(c, &mut slam, every));
    let resumed = saved.as_mut().is_some_and(|saved| saved.resume(&mut slam, &mut pictures));
    if !config.online.enabled && !resumed {
        drive.survey(&mut slam, &reporter);
    }
    let mut growing = config.online.enabled.then(|| GrowingTracks::new(&arguments.out, arguments.resume));
    drive.push_all(&mut slam, &reporter, &mut |slam, frame| {
        pictures.push(frame);
        live.show(slam, frame, &reporter);
        if let Some(growing) = &mut growing {
            tell_estimate(slam, growing, &reporter);
        }
        // After the line of the frame: a run that goes on prints those of the frames after it.
        saved.iter_mut().for_each(|saved| saved.write_when_due(slam, &pictures, &reporter));
    })?;
    if reporter.cancelled() {
        saved.iter_mut().for_each(|saved| saved.write(&slam, &pictures, &reporter));
    }
    let result =
        if config.online.enabled { slam.finish_online(&reporter) } else { slam.finish_with(&reporter) };
    reporter.finish();
    checkpoint.iter().for_each(|checkpoint| checkpoint::report(&checkpoint.perception, &reporter));
    let context = drive.context(config, fingerprint);
    let report = Report { result: &result, context: &context, evaluation: None, pictures: pictures.taken() };
    let mut extras = vec![Extra { name: "report.html".into(), content: report.html().into_bytes() }];
    extras.extend(drive.kept());
    extras.extend(drive.camera_file());
    // An error is reported once the results are safe.
    let tables = tables(arguments, &result).map(|tables| extras.extend(tables));
    let map = map_file.map_or(Ok(()), |file| crate::map::save(file, &result));
    let (directory, out) = (&directory, arguments.out.as_path());
    let results = Results { directory, out, result: &result, context: &context, extras: &extras };
    let drawn = draw::write(&results, places, frames(arguments, drive.sequence(), &reporter));
    if drawn.is_err() && checkpoint.is_some() {
        exit::eprint(
            "motorcade: what the networks found and the state of the run are kept in the checkpoint; once the results can be written, --resume goes on from there",
        );
    }
    let drawn = drawn?;
    // A run that was stopped can go on.
    if !result.interrupted {
        checkpoint.iter().for_each(Opened::remove);
        growing.into_iter().for_each(GrowingTracks::remove);
    }
    print_line(&summary(&result, arguments), &config);
    for path in drawn? {
        print_line(&path.display().to_string(), &config);
    }
    // After the results are safe: a frame that stdout did not take is an error of an online run.
    reporter.printed()?;
    tables?;
    map?;
    Ok(code(&result, &config))
}

/// The Parquet files that are asked for.
fn tables(arguments: &RunArguments, result: &RunResult) -> anyhow::Result<Vec<Extra>> {
    Ok(if arguments.parquet { motorcade_tables::extras(result, &arguments.out)? } else { Vec::new() })
}

/// The files of a run outside of its directory that must be different ones, the input first.
fn files(arguments: &RunArguments) -> impl Iterator<Item = (&str, &Path)> {
    let named = [
        ("--overlay", arguments.overlay.as_deref()),
        ("--mcap", arguments.mcap.as_deref()),
        ("--save-map", arguments.save_map.as_deref()),
    ];
    let input = Some(("the input", arguments.input.input.as_path()));
    input.into_iter().chain(named.into_iter().filter_map(|(option, path)| Some((option, path?))))
}

/// The drawings that are asked for.
fn drawings(arguments: &RunArguments) -> impl Iterator<Item = &Path> {
    arguments.overlay.as_deref().into_iter().chain(arguments.mcap.as_deref())
}

/// Places of the drawings.
fn places(arguments: &RunArguments, drive: &Drive) -> anyhow::Result<Vec<DrawingTarget>> {
    let wrong = |problem: String| Err(motorcade::Error::Config(problem).into());
    if drawings(arguments).next().is_some() && drive.sequence().is_none() {
        return wrong("--overlay and --mcap need frames to draw; this run has none".into());
    }
    if let Some(path) = arguments.mcap.as_deref().filter(|path| !draw::is_recording(path)) {
        return wrong(format!("--mcap {}: expected a name that ends in .mcap", path.display()));
    }
    drawings(arguments).map(|path| DrawingTarget::open(path, &arguments.out, arguments.force)).collect()
}

fn frames<'a>(
    arguments: &RunArguments,
    sequence: Option<&'a Sequence>,
    reporter: &'a Reporter,
) -> Option<Frames<'a>> {
    let (threads, schemas) = (threads(arguments.threads), arguments.mcap_schemas.into());
    Some(Frames { sequence: sequence?, threads, schemas, reporter })
}

/// The drawings of a run that is there already, unless they are there too.
fn draw_finished(arguments: &RunArguments, drive: &Drive) -> anyhow::Result<u8> {
    let reporter = Reporter::new(arguments.progress);
    for path in drawings(arguments).filter(|path| !path.exists()) {
        let rig = Rig::recorded(&RunRecord::read(&arguments.out)?);
        if let Some((frames, rig)) = frames(arguments, drive.sequence(), &reporter).zip(rig) {
            let drawn = frames.draw(&arguments.out, &rig, Target::open(path, false)?)?;
            exit::say(&drawn.display().to_string());
        }
    }
    Ok(exit::FINE)
}

/// The newest frame as a line on stdout, after the corrections before it, and its vehicles as rows of the growing table.
fn tell_estimate(slam: &mut Motorcade, growing: &mut GrowingTracks, reporter: &Reporter) {
    if let Some(estimate) = slam.estimate() {
        slam.take_revisions().iter().for_each(|revision| reporter.print(&revision.to_json()));
        reporter.print(&estimate.to_json());
        growing.push(&estimate, reporter);
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

/// A line on stdout; on stderr where stdout holds a JSON object a line.
fn print_line(line: &str, config: &Config) {
    if config.online.enabled { exit::eprint(line) } else { exit::say(line) }
}

/// 2 when a fault of the program ended it, 130 when interrupted, 4 when too many frames were not tracked, else 0; results are written in every case.
pub fn code(result: &RunResult, config: &Config) -> u8 {
    if result.failed {
        exit::BUG
    } else if result.interrupted {
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
        "{} frames, {:.1} m driven, {:.1} % tracked, {vehicles}, {spent:.1} s of computing\n{}\n{}",
        result.frames.len(),
        result.ego.length_m(),
        100.0 * result.tracked_share(),
        focal_length(result),
        arguments.out.display()
    )
}

/// A line on the focal length, stated and by the turns of the drive: all distances are proportional to it.
pub fn focal_length(result: &RunResult) -> String {
    match &result.focal_by_turns {
        Some(found) => format!("focal length: {found}"),
        None => "focal length: not checked (too little turning, calibrated from the drive, or online): an error is not noticed".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use motorcade::NoProgress;
    use motorcade_dataset::{Frame, SequenceOptions};
    use motorcade_perception::{Detection, VehicleDetector};

    use super::*;

    /// A detector with a fault of its own at the third frame.
    struct Faulty;

    impl VehicleDetector for Faulty {
        fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>, motorcade_perception::Error> {
            assert!(frame.number < 2, "an index out of range");
            Ok(Vec::new())
        }
        fn description(&self) -> String {
            "a detector with a fault".into()
        }
    }

    #[test]
    fn a_worker_that_panics_is_a_fault_of_the_program() {
        let folder = tempfile::tempdir().unwrap();
        for k in 0..4_u8 {
            let image = image::GrayImage::from_fn(64, 32, |x, y| image::Luma([(x * 7 + y * 11) as u8 ^ k]));
            image.save(folder.path().join(format!("{k:06}.png"))).unwrap();
        }
        let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
        let camera = motorcade_geometry::PinholeCamera {
            fx: 50.0,
            fy: 50.0,
            cx: 32.0,
            cy: 16.0,
            width: 64,
            height: 32,
        };
        for threads in [1, 2] {
            let mut slam = Motorcade::builder(camera).height_m(1.5).detector(Faulty).build().unwrap();
            motorcade::push_sequence(&mut slam, &sequence, threads, &NoProgress, &mut |_, _| {}).unwrap();
            let result = slam.finish();
            assert_eq!((code(&result, &Config::default()), result.frames.len()), (exit::BUG, 2));
        }
    }
}
