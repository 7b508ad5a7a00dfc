//! One attempt at a drive: one `motorcade run`.

use std::ffi::OsString;
use std::io;
use std::process::{Command, Stdio};

use crate::log::Log;
use crate::monitor::Stop;
use crate::options::Options;
use crate::plan::Task;
use crate::process::{self, Ending};

/// Runs the drive once, with `threads`. A directory that an earlier batch here has filled is replaced where it holds something else.
///
/// # Errors
/// A program that cannot be started, a log that cannot be written.
pub(crate) fn run(
    task: &Task<'_>,
    threads: usize,
    options: &Options,
    log: &mut Log,
    stop: &dyn Fn() -> Stop,
) -> io::Result<Ending> {
    let ending = process(task, threads, options, log, stop, task.replace)?;
    // `run` answers at once when the directory holds these results, and refuses when it holds others.
    let refused = ending.status.code() == Some(1) && !task.replace && task.ours;
    if refused && options.run_directory(&task.drive.id).join("run.json").exists() {
        return process(task, threads, options, log, stop, true);
    }
    Ok(ending)
}

fn process(
    task: &Task<'_>,
    threads: usize,
    options: &Options,
    log: &mut Log,
    stop: &dyn Fn() -> Stop,
    replace: bool,
) -> io::Result<Ending> {
    let arguments = arguments(task, threads, options, replace);
    let words = std::iter::once(options.program.as_os_str()).chain(arguments.iter().map(OsString::as_os_str));
    let words: Vec<String> = words.map(|word| quoted(&word.to_string_lossy())).collect();
    log.begin(&format!("# {}", words.join(" ")))?;
    let mut command = Command::new(&options.program);
    command.args(&arguments).stdin(Stdio::null()).stdout(log.stdio()?).stderr(log.stdio()?);
    process::run(&mut command, &options.limits, stop)
}

fn arguments(task: &Task<'_>, threads: usize, options: &Options, replace: bool) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["run".into(), "--out".into()];
    arguments.push(options.run_directory(&task.drive.id).into_os_string());
    arguments.extend(["--threads".into(), threads.to_string().into()]);
    arguments.extend(["--progress".into(), "none".into()]);
    arguments.extend(replace.then(|| "--force".into()));
    arguments.extend(task.drive.arguments());
    arguments
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
