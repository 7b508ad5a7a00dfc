//! Limits of a solve from outside: cancellation and time.

use std::time::{Duration, Instant};

use motorcade_sparse::Stop;

use super::options::{Control, Options};
use super::report::Termination;

/// Reasons to end a solve early.
pub(crate) struct Limits<'a> {
    control: &'a Control,
    stop: Stop<'a>,
    deadline: Option<Instant>,
}

impl<'a> Limits<'a> {
    /// Of work begun at `start`.
    pub(crate) fn new(control: &'a Control, stop: Stop<'a>, options: &Options, start: Instant) -> Self {
        // A limit beyond all clocks is none.
        let limit = options.time_limit_s.and_then(|limit| Duration::try_from_secs_f64(limit).ok());
        let deadline = limit.and_then(|limit| start.checked_add(limit));
        Self { control, stop, deadline }
    }

    /// The limit that was reached.
    pub(crate) fn reached(&self) -> Option<Termination> {
        if self.control.cancelled() || self.stop.asked() {
            return Some(Termination::Cancelled);
        }
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline).then_some(Termination::Time)
    }
}
