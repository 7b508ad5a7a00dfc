//! Lines on stdout from a thread of its own: a reader that stops reading must not keep a run from ending.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use motorcade::Error;
use motorcade::output::io_error;

use crate::interruption::wait_for;

/// Lines that may wait for the reader.
const WAITING: usize = 8;

/// Prints lines in their order.
pub struct Printer {
    lines: SyncSender<String>,
    /// Ends with the first error.
    thread: JoinHandle<Result<(), Error>>,
    /// True once a line was not taken after Ctrl-C.
    stuck: AtomicBool,
}

impl Printer {
    /// Ready for the first line; `print` prints each.
    pub fn new(print: impl Fn(&str) -> Result<(), Error> + Send + 'static) -> Self {
        let (lines, waiting) = sync_channel::<String>(WAITING);
        let thread = std::thread::spawn(move || {
            let mut first = Ok(());
            // All lines are taken, whatever became of those before.
            for line in waiting {
                first = first.and(print(&line));
            }
            first
        });
        Self { lines, thread, stuck: AtomicBool::new(false) }
    }

    /// Prints a line. Waits while the reader is behind, after Ctrl-C for a moment only.
    pub fn print(&self, line: &str) {
        let mut line = Some(line.to_owned());
        let mut sent = || match line.take().map(|line| self.lines.try_send(line)) {
            Some(Err(TrySendError::Full(back))) => {
                line = Some(back);
                false
            }
            _ => true,
        };
        if !self.stuck.load(Ordering::Relaxed) && !wait_for(&mut sent) {
            self.stuck.store(true, Ordering::Relaxed);
        }
    }

    /// Waits until all is printed, after Ctrl-C for a moment only.
    ///
    /// # Errors
    /// The first line that could not be printed; lines that nobody read.
    pub fn finish(self) -> Result<(), Error> {
        let Self { lines, thread, stuck } = self;
        drop(lines);
        if stuck.into_inner() || !wait_for(|| thread.is_finished()) {
            let unread = std::io::Error::other("the last lines were not read");
            return Err(io_error(Path::new("stdout"), &unread));
        }
        thread.join().unwrap_or(Ok(()))
    }
}
