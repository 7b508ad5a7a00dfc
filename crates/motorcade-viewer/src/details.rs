//! Timings, warnings, settings.

use motorcade::{RunContext, RunResult};

use crate::text::{escape, number};

/// List of warnings; empty without any.
pub(crate) fn warnings(result: &RunResult) -> String {
    if result.warnings.is_empty() {
        return String::new();
    }
    let items: String = result.warnings.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
    format!("<section><h2>Warnings</h2><ul class=\"warning\">{items}</ul></section>\n")
}

/// Table of timings.
pub(crate) fn timings(result: &RunResult) -> String {
    let mut out =
        "<section><h2>Timings</h2><table><thead><tr><th>stage</th><th>median [ms]</th><th>95 % [ms]</th>\
                   <th>total [s]</th></tr></thead><tbody>\n"
            .to_owned();
    for (stage, time) in result.stopwatch.summary() {
        out += &format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape(stage),
            number(time.p50_ms, 1),
            number(time.p95_ms, 1),
            number(time.total_s, 2)
        );
    }
    out + "</tbody></table></section>\n"
}

/// Command, sources and configuration.
pub(crate) fn settings(context: &RunContext) -> String {
    let configuration = toml::to_string_pretty(&context.config).unwrap_or_default();
    let input = serde_json::to_string_pretty(&context.input).unwrap_or_default();
    format!(
        "<section><h2>Settings</h2><p>Vehicles: {}. Road: {}.</p>\n<pre>{}</pre>\n\
         <details><summary>Configuration</summary><pre>{}</pre></details>\n\
         <details><summary>Input</summary><pre>{}</pre></details></section>\n",
        escape(&context.perception.0),
        escape(&context.perception.1),
        escape(&context.command.join(" ")),
        escape(&configuration),
        escape(&input)
    )
}
