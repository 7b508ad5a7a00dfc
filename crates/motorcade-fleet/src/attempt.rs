//! The outcome of an attempt.

use std::io;
use std::process::ExitStatus;

use crate::log::Log;
use crate::options::Options;
use crate::outcome::Outcome;
use crate::plan::Task;
use crate::process::{Bound, Ending};
use crate::run_record::{self, Found};
use crate::status::Status;

/// Outcome of a finished attempt; `stopped` is true if the batch asked the process to end.
pub(crate) fn outcome(
    task: &Task<'_>,
    options: &Options,
    ended: io::Result<Ending>,
    log: &mut Log,
    (attempts, stopped): (u32, bool),
) -> Outcome {
    let mut outcome = Outcome::pending(attempts);
    outcome.status = Status::Failed;
    let ending = match ended {
        Ok(ending) => ending,
        Err(error) => {
            outcome.message = format!("cannot start {}: {error}", options.program.display());
            return outcome;
        }
    };
    outcome.exit_code = ending.status.code();
    outcome.wall_s = ending.wall_s;
    (outcome.cpu_s, outcome.peak_rss_mb) = ending.usage.unzip();
    outcome.status = status(&ending, stopped);
    if !outcome.status.has_results() {
        outcome.message = message(&ending, outcome.peak_rss_mb, options, log);
        return outcome;
    }
    match run_record::read(&options.run_directory(&task.drive.id)) {
        Found::Whole(results) => outcome.results = Some(results),
        Found::Partial | Found::Nothing => {
            outcome.status = Status::Failed;
            outcome.message = "the process ended well, but wrote no run.json".to_owned();
        }
    }
    as_before(outcome, task.before.as_ref())
}

/// If `run` found the results already in place, keeps times and status of the attempt that made them.
fn as_before(mut outcome: Outcome, before: Option<&Outcome>) -> Outcome {
    if let Some(before) =
        before.filter(|before| before.status.has_results() && before.results == outcome.results)
    {
        let attempts = outcome.attempts;
        outcome = Outcome { attempts, ..before.clone() };
    }
    outcome
}

/// True for a failure that may not come again: a bug that depends on chance, resources, a signal.
pub(crate) fn is_temporary(outcome: &Outcome) -> bool {
    match outcome.status {
        Status::Failed => matches!(outcome.exit_code, None | Some(2 | 5)),
        Status::Interrupted => true,
        _ => false,
    }
}

fn status(ending: &Ending, stopped: bool) -> Status {
    match (ending.over, ending.status.code()) {
        (Some(Bound::Time), _) => Status::TimedOut,
        (Some(Bound::Memory), _) => Status::OutOfMemory,
        (None, Some(0)) => Status::Done,
        (None, Some(4)) => Status::TrackingFailed,
        (None, Some(130)) => Status::Interrupted,
        (None, _) if stopped => Status::Interrupted,
        (None, _) => Status::Failed,
    }
}

fn message(ending: &Ending, peak_mb: Option<f64>, options: &Options, log: &mut Log) -> String {
    match ending.over {
        Some(Bound::Time) => format!(
            "took longer than the {} s of --timeout",
            options.limits.timeout.unwrap_or_default().as_secs_f64()
        ),
        Some(Bound::Memory) => format!(
            "took {:.0} MB of memory, more than the {} MB of --memory-mb",
            peak_mb.unwrap_or_default(),
            options.limits.memory_mb.unwrap_or_default()
        ),
        None if ending.status.code().is_some() => log.last_message(),
        None => by_signal(&ending.status),
    }
}

fn by_signal(status: &ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(status) {
        let why = if signal == 9 { " (SIGKILL: the system may have run out of memory)" } else { "" };
        return format!("killed by signal {signal}{why}");
    }
    format!("ended with {status}")
}
