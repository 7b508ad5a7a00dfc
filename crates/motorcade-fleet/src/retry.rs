//! A drive with its attempts.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::attempt::{is_temporary, outcome};
use crate::error::{Error, Result};
use crate::job;
use crate::log::Log;
use crate::monitor::{Event, Monitor, Stop};
use crate::options::Options;
use crate::outcome::Outcome;
use crate::plan::Task;
use crate::state::{Line, State};

/// What all drives share.
pub(crate) struct Shared<'a> {
    pub options: &'a Options,
    pub monitor: &'a dyn Monitor,
    pub state: &'a Mutex<State>,
    /// Whether to stop, for the monitor's reasons or the batch's own.
    pub stop: &'a (dyn Fn() -> Stop + Sync),
}

/// Tries a drive, with `threads`, until it has results, fails for good, or the batch stops.
///
/// # Errors
/// A state or a log that cannot be written.
pub(crate) fn run(task: &Task<'_>, threads: usize, shared: &Shared<'_>) -> Result<Outcome> {
    let path = shared.options.log_file(&task.drive.id);
    let mut log = Log::open(&path).map_err(|e| Error::write(&path, e))?;
    let mut last = Outcome::pending(task.attempts);
    if !locked(&log, &task.drive.id, shared) {
        return Ok(last);
    }
    for number in 0..=shared.options.retries {
        if (shared.stop)() != Stop::Not || (number > 0 && !pause(number, shared)) {
            break;
        }
        let attempts = task.attempts + number + 1;
        shared.write(task, None)?;
        shared.monitor.report(&Event::Started { id: &task.drive.id, attempt: attempts });
        let ended = job::run(task, threads, shared.options, &mut log, shared.stop);
        let stopped = (shared.stop)() != Stop::Not;
        last = outcome(task, shared.options, ended, &mut log, (attempts, stopped));
        shared.write(task, Some(last.clone()))?;
        if stopped || !is_temporary(&last) {
            break;
        }
        if number < shared.options.retries {
            shared.monitor.report(&Event::Retry { id: &task.drive.id, outcome: &last });
        }
    }
    Ok(last)
}

impl Shared<'_> {
    fn write(&self, task: &Task<'_>, outcome: Option<Outcome>) -> Result<()> {
        let line = Line::now(&task.drive.id, &task.row, &task.files, outcome);
        // A thread that panicked has written whole lines.
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).append(&line)
    }
}

const POLL: Duration = Duration::from_millis(50);

/// Waits for the lock of the log; false when the batch stops before.
fn locked(log: &Log, id: &str, shared: &Shared<'_>) -> bool {
    let mut reported = false;
    while !log.try_lock() {
        if (shared.stop)() != Stop::Not {
            return false;
        }
        if !reported {
            shared.monitor.report(&Event::Waiting { id });
            reported = true;
        }
        std::thread::sleep(POLL);
    }
    true
}

/// Waits before a further attempt; false when the batch stops.
fn pause(number: u32, shared: &Shared<'_>) -> bool {
    let pause = shared.options.retry_pause.saturating_mul(1 << (number - 1).min(6));
    let start = Instant::now();
    while start.elapsed() < pause {
        if (shared.stop)() != Stop::Not {
            return false;
        }
        std::thread::sleep(POLL.min(pause));
    }
    true
}
