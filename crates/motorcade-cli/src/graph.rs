//! `motorcade graph`.

mod compare;
mod info;
mod optimise;
#[cfg(test)]
mod tests;

use motorcade_graph::Options;
use motorcade_graph::solver::{Control, Termination};

use crate::arguments::{CompareArguments, GraphCommand, InfoArguments, OptimiseArguments};
use crate::exit;
use crate::files::{Content, OutFile, all_different};
use crate::interruption;
use compare::{CompareReport, Differences, compare};
use info::{InfoReport, info};
use optimise::{OptimiseReport, OptimiseRequest, optimise};

/// Works on g2o files.
pub fn graph(command: &GraphCommand) -> anyhow::Result<u8> {
    match command {
        GraphCommand::Optimise(arguments) => optimised(arguments),
        GraphCommand::Info(arguments) => described(arguments),
        GraphCommand::Compare(arguments) => compared(arguments),
    }
}

fn optimised(arguments: &OptimiseArguments) -> anyhow::Result<u8> {
    let cancel = Some(interruption::listen());
    let outputs = [("--out", arguments.out.as_path())].into_iter();
    all_different(outputs.chain(arguments.json.as_deref().map(|json| ("--json", json))))?;
    let json = OutFile::create_optional(arguments.json.as_deref(), Content::GraphReport)?;
    let out = OutFile::create(&arguments.out, Content::Graph)?;
    let (report, text) = optimise(&OptimiseRequest {
        input: arguments.input.clone(),
        options: Options {
            method: arguments.method,
            max_iterations: arguments.iterations,
            threads: arguments.threads,
            time_limit_s: arguments.time_limit_s,
            ..Options::default()
        },
        cost: arguments.cost,
        robust: arguments.robust,
        init: arguments.init,
        control: Control { cancel, progress: None },
    })?;
    out.write(&text)?;
    if let Some(file) = json {
        file.write(&(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    exit::say(&optimise_text(&report));
    Ok(if report.termination == Termination::Cancelled { exit::INTERRUPTED } else { exit::FINE })
}

fn optimise_text(r: &OptimiseReport) -> String {
    let mut lines = vec![
        format!("cost        {:.6e} -> {:.6e}", r.initial_cost, r.final_cost),
        format!("iterations  {} ({})", r.iterations, why(r.termination)),
        format!("time        {:.3} s CPU, starting values {:.3} s", r.optimise_s, r.init_s),
        format!("components  {}", r.components),
    ];
    if r.initial_cost != r.file_cost {
        lines.insert(0, format!("file cost   {:.6e}", r.file_cost));
    }
    if !r.anchors.is_empty() {
        let ids: Vec<String> = r.anchors.iter().take(10).map(u64::to_string).collect();
        let more = if r.anchors.len() > 10 { ", …" } else { "" };
        lines.push(format!("held        vertex {}{more}", ids.join(", ")));
    }
    lines.extend(met(r.read.clamped_information, &r.read.unknown_tags));
    lines.join("\n")
}

fn why(termination: Termination) -> &'static str {
    match termination {
        Termination::Converged => "converged",
        Termination::SmallStep => "converged: steps too small to matter",
        Termination::Iterations => "stopped at the limit of iterations",
        Termination::Time => "stopped at the time limit",
        Termination::Cancelled => "interrupted",
        Termination::Stalled => "stalled",
        Termination::NothingToDo => "nothing to do: every vertex is fixed",
    }
}

/// Findings while reading a file, for its owner.
fn met(clamped: usize, unknown: &std::collections::BTreeMap<String, usize>) -> Vec<String> {
    let mut lines = Vec::new();
    if clamped > 0 {
        lines.push(format!("repaired    {clamped} indefinite information matrices"));
    }
    lines.extend(unknown.iter().map(|(tag, count)| format!("left out    {count} lines of {tag}")));
    lines
}

fn described(arguments: &InfoArguments) -> anyhow::Result<u8> {
    let report = info(&arguments.input)?;
    exit::print(&if arguments.json { serde_json::to_string_pretty(&report)? } else { info_text(&report) })?;
    Ok(exit::FINE)
}

fn info_text(r: &InfoReport) -> String {
    let read = &r.read;
    let (least, mean, most) = r.degree;
    let mut lines = vec![
        format!("vertices    {} SE(3), {} SE(2), {} fixed", read.vertices_se3, read.vertices_se2, read.fixed),
        format!("edges       {} SE(3), {} SE(2)", read.edges_se3, read.edges_se2),
        format!("degree      {least} to {most}, mean {mean:.2}"),
        format!("components  {}", r.components.len()),
    ];
    if let Some((low, high)) = r.bounds_m {
        let size: Vec<String> = low.iter().zip(&high).map(|(a, b)| format!("{:.2}", b - a)).collect();
        lines.push(format!("extent      {} m", size.join(" x ")));
    }
    lines.push(format!("cost        {:.6e} (log), {:.6e} (mqt)", r.cost_log, r.cost_mqt));
    lines.extend(met(read.clamped_information, &read.unknown_tags));
    lines.join("\n")
}

fn compared(arguments: &CompareArguments) -> anyhow::Result<u8> {
    let report = compare(&arguments.first, &arguments.second)?;
    exit::print(&if arguments.json {
        serde_json::to_string_pretty(&report)?
    } else {
        compare_text(&report)
    })?;
    Ok(exit::FINE)
}

fn compare_text(r: &CompareReport) -> String {
    let difference = |name: &str, d: &Differences| {
        format!(
            "{name:<12}position {:.6} m RMS, {:.6} m largest; rotation {:.6} rad RMS, {:.6} rad largest",
            d.position_rms_m, d.position_max_m, d.rotation_rms_rad, d.rotation_max_rad
        )
    };
    let cost = |name: &str, (first, second): (f64, Option<f64>)| {
        let second = second.map_or_else(|| "-".to_owned(), |c| format!("{c:.6e}"));
        format!("{name:<12}{first:.6e}, with the second's vertices {second}")
    };
    [
        format!(
            "vertices    {} in both, {} only in the first, {} only in the second",
            r.common, r.only_first, r.only_second
        ),
        difference("as they are", &r.raw),
        difference("aligned", &r.aligned),
        cost("cost (log)", r.cost_log),
        cost("cost (mqt)", r.cost_mqt),
    ]
    .join("\n")
}
