//! Progress of a run.

/// Receives progress; the pipeline knows nothing of terminals.
pub trait Progress: Sync {
    /// A stage begins; `total` steps when known.
    fn begin(&self, stage: &'static str, total: Option<usize>);
    /// Steps done of the present stage.
    fn advance(&self, done: usize);
    /// A warning; it also stands in `run.json`.
    fn warn(&self, message: &str);
    /// True when the user wants to stop: the run ends with what it has.
    fn cancelled(&self) -> bool {
        false
    }
}

/// A request to stop that comes after the last frame. A drive that was stopped `among` its frames is estimated from those before; one that is
/// stopped later has what is estimated by then.
pub(crate) fn stopped_after_frames<'a>(
    among: bool,
    progress: &'a dyn Progress,
) -> impl Fn() -> bool + Sync + 'a {
    let before = among && progress.cancelled();
    move || !before && progress.cancelled()
}

/// Progress sink that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn begin(&self, _stage: &'static str, _total: Option<usize>) {}
    fn advance(&self, _done: usize) {}
    fn warn(&self, _message: &str) {}
}
