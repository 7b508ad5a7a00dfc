//! `motorcade simulate`.

use std::path::Path;

use anyhow::bail;
use motorcade::Progress;
use motorcade_simulate::{RenderOptions, Scenario, WriteOptions, Written, scenarios, simulate as plan};

use crate::arguments::SimulateArguments;
use crate::exit;
use crate::progress::Reporter;

/// Lists scenarios, or renders one.
pub fn simulate(arguments: &SimulateArguments) -> anyhow::Result<u8> {
    if arguments.list {
        for scenario in scenarios() {
            exit::print(&format!("{:<20} {}", scenario.name, scenario.description));
        }
        return Ok(exit::FINE);
    }
    // clap asks for both unless --list is given.
    let (Some(name), Some(out)) = (&arguments.scenario, &arguments.out) else {
        bail!("--scenario and --out are needed")
    };
    let occupied = std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
    if occupied && !arguments.force {
        bail!("{} is not empty; choose another --out or add --force to write over it", out.display());
    }
    let reporter = Reporter::new(arguments.progress);
    let render = RenderOptions::default().with_width(arguments.width);
    let options =
        WriteOptions { depth: arguments.depth, instance: arguments.instance, ..WriteOptions::default() };
    let written = write(name, arguments.frames, arguments.seed, &render, &options, out, &reporter)?;
    reporter.finish();
    exit::print(&format!(
        "{} frames, {} labelled boxes\n{}",
        arguments.frames,
        written.labels,
        written.training.display()
    ));
    Ok(exit::FINE)
}

/// Renders a scenario into a folder.
pub fn write(
    name: &str,
    frames: usize,
    seed: u64,
    render: &RenderOptions,
    options: &WriteOptions,
    out: &Path,
    reporter: &Reporter,
) -> anyhow::Result<Written> {
    let Some(scenario) = Scenario::by_name(name) else {
        let known: Vec<String> = scenarios().into_iter().map(|s| s.name).collect();
        bail!("unknown scenario `{name}`; known are {}", known.join(", "));
    };
    let drive = plan(&scenario, frames, seed, render)?;
    reporter.begin("rendering", Some(frames));
    Ok(drive.write_kitti(out, options, &|done| reporter.advance(done))?)
}
