//! Progress on stderr.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use motorcade::Progress;

use crate::arguments::ProgressKind;
use crate::exit::eprint;
use crate::interruption;
use crate::printer::Printer;

/// Progress for a terminal, a log or a program.
pub struct Reporter {
    kind: ProgressKind,
    bar: ProgressBar,
    stage: Mutex<(&'static str, Option<usize>)>,
    last_reported: AtomicUsize,
    interrupted: Arc<AtomicBool>,
    printer: Mutex<Option<Printer>>,
}

/// The kind of progress that suits stderr, and its bar, which is hidden where there is none.
pub fn kind_and_bar(kind: ProgressKind) -> (ProgressKind, ProgressBar) {
    let kind = match kind {
        ProgressKind::Auto if std::io::stderr().is_terminal() => ProgressKind::Auto,
        ProgressKind::Auto => ProgressKind::Plain,
        other => other,
    };
    let bar = if kind == ProgressKind::Auto { ProgressBar::new(0) } else { ProgressBar::hidden() };
    (kind, bar)
}

impl Reporter {
    /// Sets up the kind asked for and listens to Ctrl-C: the first asks to stop, the second stops.
    pub fn new(kind: ProgressKind) -> Self {
        let (kind, bar) = kind_and_bar(kind);
        Self {
            kind,
            bar,
            stage: Mutex::new(("", None)),
            last_reported: AtomicUsize::new(0),
            interrupted: interruption::listen(),
            printer: Mutex::new(None),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// One line of results on stdout, beside the bar.
    pub fn print(&self, line: &str) {
        let bar = self.bar.clone();
        // A bar that is suspended keeps all others waiting: lines that go elsewhere leave it alone.
        let beside = self.kind == ProgressKind::Auto && std::io::stdout().is_terminal();
        let print = move |line: &str| {
            if beside { bar.suspend(|| crate::exit::print(line)) } else { crate::exit::print(line) }
        };
        let new = || Printer::new(print);
        if let Ok(mut printer) = self.printer.lock() {
            printer.get_or_insert_with(new).print(line);
        }
    }

    /// Waits until all is printed; the first error of [`print`](Self::print).
    pub fn printed(&self) -> Result<(), motorcade::Error> {
        let printer = self.printer.lock().ok().and_then(|mut printer| printer.take());
        printer.map_or(Ok(()), Printer::finish)
    }

    fn stage(&self) -> (&'static str, Option<usize>) {
        self.stage.lock().map(|s| *s).unwrap_or_default()
    }
}

impl Progress for Reporter {
    fn begin(&self, stage: &'static str, total: Option<usize>) {
        if let Ok(mut present) = self.stage.lock() {
            *present = (stage, total);
        }
        self.last_reported.store(0, Ordering::Relaxed);
        match self.kind {
            ProgressKind::Auto => {
                self.bar.reset();
                self.bar.set_length(total.unwrap_or(0) as u64);
                let template = "{msg:10} [{bar:40}] {pos}/{len} frames {per_sec} eta {eta}";
                if let Ok(style) = ProgressStyle::with_template(template) {
                    self.bar.set_style(style.progress_chars("=> "));
                }
                self.bar.set_message(stage);
                self.bar.enable_steady_tick(Duration::from_millis(250));
            }
            ProgressKind::Plain => match total {
                Some(n) => eprint(&format!("{stage}: {n} frames")),
                None => eprint(stage),
            },
            ProgressKind::Json => eprint(&serde_json::json!({"stage": stage, "total": total}).to_string()),
            ProgressKind::None => {}
        }
    }

    fn advance(&self, done: usize) {
        let (stage, total) = self.stage();
        match self.kind {
            ProgressKind::Auto => self.bar.set_position(done as u64),
            ProgressKind::Plain => {
                // A line every tenth of the way, or every 500 frames of an endless one.
                let every = total.map_or(500, |n| n.div_ceil(10)).max(1);
                if done / every > self.last_reported.swap(done, Ordering::Relaxed) / every {
                    eprint(&format!("{stage}: {done}/{}", total.map_or("?".to_owned(), |n| n.to_string())));
                }
            }
            ProgressKind::Json => {
                eprint(&serde_json::json!({"stage": stage, "done": done, "total": total}).to_string());
            }
            ProgressKind::None => {}
        }
    }

    fn warn(&self, message: &str) {
        match self.kind {
            ProgressKind::Json => eprint(&serde_json::json!({"warning": message}).to_string()),
            ProgressKind::Auto => self.bar.suspend(|| eprint(&format!("warning: {message}"))),
            _ => eprint(&format!("warning: {message}")),
        }
    }

    fn cancelled(&self) -> bool {
        self.interrupted.load(Ordering::SeqCst)
    }
}
