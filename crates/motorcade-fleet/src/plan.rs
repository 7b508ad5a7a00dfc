//! Decides for each drive whether it is run, replaced or kept.

use crate::drive::Drive;
use crate::history::{History, Known};
use crate::options::Options;
use crate::outcome::Outcome;
use crate::run_record::{self, Found};
use crate::status::Status;

/// A drive with its record in the state files.
#[derive(Clone, Debug)]
pub(crate) struct Task<'a> {
    /// The drive.
    pub drive: &'a Drive,
    /// Hash of the row.
    pub row: String,
    /// Hash of the files.
    pub files: String,
    /// Outcome of the last attempt with this row.
    pub before: Option<Outcome>,
    /// Attempts before.
    pub attempts: u32,
    /// True when the directory of results was made by an earlier batch here: it may be replaced.
    pub ours: bool,
    /// True when it must be.
    pub replace: bool,
    /// The outcome, where nothing is to be done.
    pub kept: Option<Outcome>,
}

impl<'a> Task<'a> {
    pub(crate) fn new(drive: &'a Drive, options: &Options, history: &History) -> Self {
        let mut task = Self {
            drive,
            row: drive.row_hash(),
            files: drive.files_hash(),
            before: None,
            attempts: 0,
            ours: false,
            replace: false,
            kept: None,
        };
        if let Some(known) = history.of(&drive.id) {
            task.recall(known, options);
        }
        task
    }

    fn recall(&mut self, known: &Known, options: &Options) {
        let found = run_record::read(&options.run_directory(&self.drive.id));
        self.ours = true;
        if known.row != self.row {
            self.replace = true;
            return;
        }
        self.attempts = known.attempts;
        self.before.clone_from(&known.outcome);
        self.replace = matches!(found, Found::Partial);
        // Where files have another size or time, `run` itself looks whether its results are the same.
        let Some(outcome) = known.outcome.as_ref().filter(|_| known.files == self.files) else { return };
        let keep = match (&outcome.results, found) {
            (Some(ours), Found::Whole(there)) => {
                outcome.status.has_results() && ours.fingerprint == there.fingerprint
            }
            _ => is_lasting(outcome) && !options.retry_failed,
        };
        self.kept = keep.then(|| outcome.clone());
    }
}

/// True for a failure that the same input will give again: usage, input.
pub(crate) fn is_lasting(outcome: &Outcome) -> bool {
    outcome.status == Status::Failed && matches!(outcome.exit_code, Some(1 | 3))
}
