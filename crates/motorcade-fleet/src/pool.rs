//! Several drives at a time.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::cores::Cores;
use crate::error::{Error, Result};
use crate::monitor::{Event, Monitor, Stop};
use crate::options::Options;
use crate::outcome::Outcome;
use crate::plan::Task;
use crate::retry::{self, Shared};
use crate::state::State;

/// Works on all tasks; outcomes in their order, pending for those that were not begun.
///
/// # Errors
/// The first file that cannot be written. Drives in work are stopped then.
pub(crate) fn run(
    tasks: &[Task<'_>],
    options: &Options,
    state: State,
    monitor: &dyn Monitor,
) -> Result<Vec<Outcome>> {
    let (next, broken) = (AtomicUsize::new(0), AtomicBool::new(false));
    let state = Mutex::new(state);
    let first_error: Mutex<Option<Error>> = Mutex::new(None);
    let outcomes: Vec<Mutex<Option<Outcome>>> =
        tasks.iter().map(|task| Mutex::new(task.kept.clone())).collect();
    let stop = || if broken.load(Ordering::SeqCst) { monitor.stop().max(Stop::Soon) } else { monitor.stop() };
    let shared = Shared { options, monitor, state: &state, stop: &stop };
    let waiting = tasks.iter().filter(|task| task.kept.is_none()).count();
    let jobs = options.jobs.clamp(1, waiting.max(1));
    let cores = Cores::deal(jobs, options.pin);
    let work = |job: usize| {
        cores.bind(job);
        let threads = if options.threads > 0 { options.threads } else { cores.threads(job) };
        while stop() == Stop::Not {
            let number = next.fetch_add(1, Ordering::SeqCst);
            let Some((task, place)) = tasks.get(number).zip(outcomes.get(number)) else { return };
            if task.kept.is_some() {
                continue;
            }
            match retry::run(task, threads, &shared) {
                Ok(outcome) => {
                    monitor.report(&Event::Finished { id: &task.drive.id, outcome: &outcome });
                    put(place, outcome);
                }
                Err(error) => {
                    broken.store(true, Ordering::SeqCst);
                    first_error.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error);
                }
            }
        }
    };
    std::thread::scope(|scope| {
        let work = &work;
        for job in 0..jobs {
            scope.spawn(move || work(job));
        }
    });
    if let Some(error) = first_error.into_inner().unwrap_or_else(|e| e.into_inner()) {
        return Err(error);
    }
    let taken = outcomes.into_iter().map(|place| place.into_inner().unwrap_or_else(|e| e.into_inner()));
    Ok(taken.zip(tasks).map(|(o, task)| o.unwrap_or_else(|| Outcome::pending(task.attempts))).collect())
}

fn put(place: &Mutex<Option<Outcome>>, outcome: Outcome) {
    *place.lock().unwrap_or_else(|e| e.into_inner()) = Some(outcome);
}
