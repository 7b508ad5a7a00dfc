//! One process with bounds.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use crate::monitor::Stop;
use crate::options::Limits;
use crate::usage::{self, Sample};

/// A finished process.
#[derive(Clone, Debug)]
pub(crate) struct Ending {
    /// Exit status.
    pub status: ExitStatus,
    /// The bound that it exceeded.
    pub over: Option<Bound>,
    /// Its time \[s\].
    pub wall_s: f64,
    /// Its processor time \[s\] and most memory \[MB\], where the system says.
    pub usage: Option<(f64, f64)>,
}

/// A bound of a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bound {
    /// Time.
    Time,
    /// Memory.
    Memory,
}

const POLL: Duration = Duration::from_millis(50);

/// Starts the process and waits for its end. `stop` is asked several times a second.
///
/// # Errors
/// A program that cannot be started.
pub(crate) fn run(command: &mut Command, limits: &Limits, stop: &dyn Fn() -> Stop) -> io::Result<Ending> {
    let start = Instant::now();
    // Ctrl-C on the terminal reaches the batch alone, which then asks its processes once.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command.spawn()?;
    let mut watch = Watch { over: None, sent: Stop::Not, usage: None };
    loop {
        let sample = usage::sample(child.id());
        watch.add(sample.as_ref());
        if sample.is_none_or(|sample| sample.ended)
            && let Some(status) = child.try_wait()?
        {
            let wall_s = start.elapsed().as_secs_f64();
            return Ok(Ending { status, over: watch.over, wall_s, usage: watch.usage });
        }
        watch.act(&mut child, limits, stop(), start.elapsed(), sample.as_ref());
        std::thread::sleep(POLL);
    }
}

/// Usage of a running process, and the signals sent to it.
struct Watch {
    over: Option<Bound>,
    sent: Stop,
    usage: Option<(f64, f64)>,
}

impl Watch {
    fn add(&mut self, sample: Option<&Sample>) {
        if let Some(sample) = sample {
            let (cpu_s, peak_mb) = self.usage.unwrap_or_default();
            self.usage = Some((cpu_s.max(sample.cpu_s), peak_mb.max(sample.rss_mb).max(sample.peak_mb)));
        }
    }

    fn act(
        &mut self,
        child: &mut Child,
        limits: &Limits,
        stop: Stop,
        time: Duration,
        sample: Option<&Sample>,
    ) {
        let memory = limits.memory_mb.zip(sample).is_some_and(|(most, sample)| sample.rss_mb > most as f64);
        if memory {
            self.over = self.over.or(Some(Bound::Memory));
        } else if limits.timeout.is_some_and(|most| time > most) {
            self.over = self.over.or(Some(Bound::Time));
        }
        let wanted = if self.over.is_some() { Stop::Now } else { stop };
        if wanted > self.sent {
            self.sent = wanted;
            if wanted == Stop::Now { kill(child) } else { interrupt(child) }
        }
    }
}

/// The process has not been waited for, so its number is still its own.
#[cfg(unix)]
fn pid(child: &Child) -> Option<rustix::process::Pid> {
    i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw)
}

/// Asks the process to write what it has and end.
fn interrupt(child: &mut Child) {
    // SIGTERM, which `run` takes as it takes SIGINT: shells have their background processes ignore that one. A process that has
    // ended in the meantime needs no signal.
    #[cfg(unix)]
    let _ = pid(child).map(|pid| rustix::process::kill_process(pid, rustix::process::Signal::TERM));
    #[cfg(not(unix))]
    let _ = child.kill();
}

/// Ends the process and those it started.
fn kill(child: &mut Child) {
    #[cfg(unix)]
    let _ = pid(child).map(|pid| rustix::process::kill_process_group(pid, rustix::process::Signal::KILL));
    let _ = child.kill();
}
