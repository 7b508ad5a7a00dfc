//! Progress over all drives of a batch, and the answer to Ctrl-C.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use motorcade_fleet::{Event, Monitor, Outcome, Stop};

use crate::arguments::ProgressKind;
use crate::exit::eprint;
use crate::progress::kind_and_bar;

/// Progress for a terminal, a log or a program.
pub struct BatchReporter {
    kind: ProgressKind,
    bar: ProgressBar,
    counts: Mutex<Counts>,
    interrupts: Arc<AtomicUsize>,
}

#[derive(Clone, Copy, Default)]
struct Counts {
    total: usize,
    done: usize,
    failed: usize,
}

impl BatchReporter {
    /// Sets up the kind asked for and listens to Ctrl-C.
    pub fn new(kind: ProgressKind) -> Self {
        let (kind, bar) = kind_and_bar(kind);
        let interrupts = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&interrupts);
        // A second handler (tests in one process) is refused.
        let _ = ctrlc::set_handler(move || match count.fetch_add(1, Ordering::SeqCst) {
            0 => {
                eprint("motorcade: stopping; drives in work write what they have (Ctrl-C again to kill them)")
            }
            _ => eprint("motorcade: killing the drives in work"),
        });
        Self { kind, bar, counts: Mutex::default(), interrupts }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn count(&self, change: impl FnOnce(&mut Counts)) -> Counts {
        let mut counts = self.counts.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        change(&mut counts);
        *counts
    }

    fn line(&self, json: impl FnOnce() -> serde_json::Value, text: impl FnOnce() -> String) {
        match self.kind {
            ProgressKind::Json => eprint(&json().to_string()),
            ProgressKind::Plain => eprint(&text()),
            ProgressKind::Auto => self.bar.suspend(|| eprint(&text())),
            ProgressKind::None => {}
        }
    }

    fn begin(&self, counts: Counts) {
        if let Ok(style) = ProgressStyle::with_template("[{bar:40}] {pos}/{len} drives, {msg}eta {eta}") {
            self.bar.set_style(style.progress_chars("=> "));
        }
        self.bar.set_length(counts.total as u64);
        self.bar.set_position((counts.done + counts.failed) as u64);
        self.bar.reset_eta();
        self.bar.enable_steady_tick(Duration::from_millis(250));
        let Counts { total, done, failed } = counts;
        self.line(
            || serde_json::json!({"stage": "batch", "total": total, "done": done, "failed": failed}),
            || match failed {
                0 => format!("batch: {total} drives, {done} done before"),
                _ => format!(
                    "batch: {total} drives, {done} done before, {failed} failed before and are left so"
                ),
            },
        );
    }

    fn finished(&self, id: &str, outcome: &Outcome) {
        let good = outcome.status.has_results();
        let counts = self.count(|c| if good { c.done += 1 } else { c.failed += 1 });
        self.bar.set_position((counts.done + counts.failed) as u64);
        if counts.failed > 0 {
            self.bar.set_message(format!("{} failed, ", counts.failed));
        }
        // A bar says enough about drives that go well.
        if good && self.kind == ProgressKind::Auto {
            return;
        }
        self.line(
            || {
                serde_json::json!({"stage": "batch", "total": counts.total, "done": counts.done, "failed": counts.failed,
                    "id": id, "status": outcome.status, "message": outcome.message})
            },
            || {
                let all = counts.done + counts.failed;
                format!("batch: {all}/{}, {id}: {}", counts.total, described(outcome))
            },
        );
    }
}

fn described(outcome: &Outcome) -> String {
    let name = outcome.status.name().replace('_', " ");
    match &outcome.results {
        Some(results) => format!("{name}, {} frames in {:.1} s", results.frames, outcome.wall_s),
        None if outcome.message.is_empty() => name,
        None => format!("{name}: {}", outcome.message),
    }
}

impl Monitor for BatchReporter {
    fn report(&self, event: &Event<'_>) {
        match *event {
            Event::Begin { total, done, failed } => {
                self.begin(self.count(|c| *c = Counts { total, done, failed }))
            }
            Event::Started { id, attempt } => {
                if self.kind != ProgressKind::Auto {
                    self.line(
                        || serde_json::json!({"stage": "batch", "id": id, "status": "started", "attempt": attempt}),
                        || format!("batch: {id}: begins, attempt {attempt}"),
                    );
                }
            }
            Event::Waiting { id } => self.line(
                || serde_json::json!({"warning": format!("{id}: another process works on it")}),
                || format!("warning: {id}: another process works on it; waiting for its end"),
            ),
            Event::Retry { id, outcome } => self.line(
                || serde_json::json!({"warning": format!("{id}: {}", described(outcome))}),
                || format!("warning: {id}: {}; it is tried again", described(outcome)),
            ),
            Event::Finished { id, outcome } => self.finished(id, outcome),
        }
    }

    fn stop(&self) -> Stop {
        match self.interrupts.load(Ordering::SeqCst) {
            0 => Stop::Not,
            1 => Stop::Soon,
            _ => Stop::Now,
        }
    }
}
