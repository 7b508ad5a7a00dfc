//! Work on a thread of its own while the calling thread looks for Ctrl-C and reports progress.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::{Duration, Instant};

use motorcade::Progress;
use pyo3::prelude::*;

use crate::errors::{Failure, ResourceError};

/// Time between two looks for Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Longest wait for a thread that was asked to stop: a few frames. After it the thread is left to end by itself, because the
/// last stages of a drive cannot be stopped.
const LONGEST_WAIT: Duration = Duration::from_secs(3);
/// As a main thread's; recursive decoders fit into no less.
const STACK_BYTES: usize = 8 << 20;

enum Event<T> {
    Begin(&'static str, Option<usize>),
    Advance(usize),
    Warn(String),
    Done(Result<T, Failure>),
}

/// Passes progress on, and the wish to stop.
pub struct Watch {
    stop: Arc<AtomicBool>,
    forward: Arc<Mutex<Forward>>,
}

type Forward = Box<dyn Fn(Event<()>) + Send>;

fn send(to: &Mutex<Forward>, event: Event<()>) {
    if let Ok(forward) = to.lock() {
        forward(event);
    }
}

impl Watch {
    /// The flag that is raised to stop.
    pub fn stop(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }
    /// Passes on the iterations of a solver.
    pub fn iterations(&self) -> motorcade_graph::solver::Progress {
        let to = Arc::clone(&self.forward);
        Arc::new(move |row| send(&to, Event::Advance(row.iteration)))
    }
}

impl Progress for Watch {
    fn begin(&self, stage: &'static str, total: Option<usize>) {
        send(&self.forward, Event::Begin(stage, total));
    }
    fn advance(&self, done: usize) {
        send(&self.forward, Event::Advance(done));
    }
    fn warn(&self, message: &str) {
        send(&self.forward, Event::Warn(message.to_owned()));
    }
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Runs `work` on another thread without the interpreter's lock. `progress` is called as `progress(stage, done, total)` on the
/// calling thread, warnings go to the logger `motorcade`.
///
/// # Errors
/// Those of `work`; `KeyboardInterrupt`, and what `progress` raises: the work is then asked to stop and its result is dropped.
pub fn supervised<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = channel::<Event<T>>();
    let stop = Arc::new(AtomicBool::new(false));
    let watch =
        Watch { stop: Arc::clone(&stop), forward: Arc::new(Mutex::new(Box::new(forward(sender.clone())))) };
    let begun = Builder::new().name("motorcade".into()).stack_size(STACK_BYTES).spawn(move || {
        let result = work(&watch);
        // Nobody waits any more after an interruption.
        let _ = sender.send(Event::Done(result));
    });
    let worker = begun.map_err(|e| ResourceError::new_err(format!("cannot start a thread: {e}")))?;
    let receiver = Mutex::new(receiver);
    let mut stage = ("", None);
    loop {
        let event = py.detach(|| next(&receiver, LOOK_EVERY));
        let handled = py.check_signals().and_then(|()| match &event {
            Ok(event) => report(py, progress, event, &mut stage),
            Err(_) => Ok(()),
        });
        if let Err(error) = handled {
            stop.store(true, Ordering::Relaxed);
            py.detach(|| wait(&receiver));
            return Err(error);
        }
        match event {
            Ok(Event::Done(result)) => return Ok(result?),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Err(ResourceError::new_err("the work ended without a result")),
            },
        }
    }
}

fn forward<T: Send + 'static>(sender: Sender<Event<T>>) -> impl Fn(Event<()>) + Send + 'static {
    move |event| {
        let event = match event {
            Event::Begin(stage, total) => Event::Begin(stage, total),
            Event::Advance(done) => Event::Advance(done),
            Event::Warn(message) => Event::Warn(message),
            Event::Done(_) => return,
        };
        // Nobody listens any more after an interruption.
        let _ = sender.send(event);
    }
}

fn next<T>(receiver: &Mutex<Receiver<Event<T>>>, longest: Duration) -> Result<Event<T>, RecvTimeoutError> {
    receiver.lock().map_or(Err(RecvTimeoutError::Disconnected), |receiver| receiver.recv_timeout(longest))
}

/// Waits for the end of work that was asked to stop, for so long as it may take.
fn wait<T>(receiver: &Mutex<Receiver<Event<T>>>) {
    let start = Instant::now();
    while start.elapsed() < LONGEST_WAIT {
        match next(receiver, LOOK_EVERY) {
            Ok(Event::Done(_)) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

fn report<T>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    event: &Event<T>,
    stage: &mut (&'static str, Option<usize>),
) -> PyResult<()> {
    let done = match event {
        Event::Begin(name, total) => {
            *stage = (*name, *total);
            0
        }
        Event::Advance(done) => *done,
        Event::Warn(message) => {
            let logger = py.import("logging")?.call_method1("getLogger", ("motorcade",))?;
            // As an argument: a message may hold percent signs.
            return logger.call_method1("warning", ("%s", message)).map(drop);
        }
        Event::Done(_) => return Ok(()),
    };
    match progress {
        Some(progress) => progress.call1((stage.0, done, stage.1)).map(drop),
        None => Ok(()),
    }
}
