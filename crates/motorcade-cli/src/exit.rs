//! Exit codes: 0 fine · 1 usage or configuration · 2 a bug · 3 input unreadable or corrupt · 4 tracking failed on too many
//! frames (results written) · 5 resources · 130 interrupted (results written).

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// All went well.
pub const FINE: u8 = 0;
/// A fault of the program.
pub const BUG: u8 = 2;
/// Tracking failed on too many frames.
pub const TRACKING_FAILED: u8 = 4;
/// Interrupted, with what there was written.
pub const INTERRUPTED: u8 = 130;

/// Work that was stopped, and what became of it.
#[derive(Debug)]
pub struct Stopped(pub &'static str);

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl std::error::Error for Stopped {}

/// Prints clap's message; help and version are fine, all else is usage.
pub fn usage(error: &clap::Error) -> ExitCode {
    // Nothing can be done about a closed terminal.
    let _ = error.print();
    ExitCode::from(if error.use_stderr() { 1 } else { FINE })
}

/// Turns the outcome of a command into a message and a code.
pub fn report(outcome: anyhow::Result<u8>) -> ExitCode {
    match outcome {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            let code = code_of(&error);
            eprint(&format!("motorcade: {}", message(&error)));
            ExitCode::from(code)
        }
    }
}

/// The error and its causes, each once: many messages already hold their cause.
fn message(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    readable(&text)
}

/// Most characters of a line of an error: a parser repeats the line of the file that it stopped at, whatever its length.
const LONGEST_LINE: usize = 500;

/// A message whose long lines are cut.
fn readable(text: &str) -> String {
    let cut = |line: &str| match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line.to_owned(),
    };
    text.lines().map(cut).collect::<Vec<_>>().join("\n")
}

/// One line on stderr; a stderr that is closed or full ends nothing.
pub fn eprint(message: &str) {
    let _ = writeln!(io::stderr(), "{message}");
}

/// One line of data on stdout. A reader that has gone needs no more, and is no error.
///
/// # Errors
/// Anything else that keeps the line from being written, such as a full disk.
pub fn print(line: &str) -> Result<(), motorcade::Error> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(motorcade::output::io_error(Path::new("stdout"), &e))
        }
        _ => Ok(()),
    }
}

/// One line on stdout after the results are written: nothing is lost with it.
pub fn say(message: &str) {
    let _ = print(message);
}

fn code_of(error: &anyhow::Error) -> u8 {
    use motorcade_simulate::Error as Simulation;
    for cause in error.chain() {
        if let Some(e) = cause.downcast_ref::<motorcade::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_dataset::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_perception::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_mcap::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_map::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_fleet::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_tables::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_evaluate::Error>() {
            return e.exit_code();
        }
        if let Some(e) = cause.downcast_ref::<motorcade_graph::GraphError>() {
            return code_of_graph(e);
        }
        // A prior that does not read, or does not hold what it must.
        if cause.downcast_ref::<motorcade_shape::PriorError>().is_some() {
            return 3;
        }
        if cause.downcast_ref::<Stopped>().is_some() {
            return INTERRUPTED;
        }
        if let Some(Simulation::Cancelled) = cause.downcast_ref() {
            return INTERRUPTED;
        }
        // Pictures are made in memory: encoding one fails only where it cannot be written.
        if let Some(Simulation::Io { .. } | Simulation::Image { .. }) = cause.downcast_ref() {
            return 5;
        }
        if cause.downcast_ref::<io::Error>().is_some() {
            return 3;
        }
    }
    1
}

fn code_of_graph(error: &motorcade_graph::GraphError) -> u8 {
    use motorcade_graph::GraphError as E;
    match error {
        E::Option { .. } => 1,
        E::Threads(_) => 5,
        // The files are the only source of these here.
        E::Parse { .. } | E::Io { .. } | E::Information(_) | E::NotFinite | E::Singular => 3,
        // A graph that was read is consistent in itself: anything else is ours.
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_of_a_message_are_cut() {
        let cut = readable(&format!("x.toml: not a table\n{}\nexpected `]`", "ü".repeat(200_000)));
        assert!(cut.starts_with("x.toml: not a table\nüü") && cut.ends_with("ü…\nexpected `]`"));
        assert_eq!(cut.chars().count(), 20 + LONGEST_LINE + 1 + 13);
    }
}
