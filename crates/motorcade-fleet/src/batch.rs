//! A batch: all drives of a manifest, or of a shard of it.

use std::fs;
use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::history::History;
use crate::manifest::Manifest;
use crate::monitor::{Event, Monitor};
use crate::options::Options;
use crate::outcome::Outcome;
use crate::plan::Task;
use crate::pool;
use crate::state::State;
use crate::status::Status;
use crate::summary;

/// Result of a batch.
#[derive(Clone, Debug)]
pub struct Report {
    /// Id and outcome of each drive of the shard, in the manifest's order.
    pub outcomes: Vec<(String, Outcome)>,
    /// Tables that were written.
    pub tables: Vec<PathBuf>,
}

impl Report {
    /// Number of drives of a status.
    pub fn count(&self, status: Status) -> usize {
        self.outcomes.iter().filter(|(_, outcome)| outcome.status == status).count()
    }

    /// Exit code of the program: 0 when every drive has results, 130 when the batch was stopped before all were tried, 4 when
    /// all were tried and some have no results.
    pub fn exit_code(&self) -> u8 {
        if self.count(Status::Interrupted) + self.count(Status::Pending) > 0 {
            130
        } else if self.outcomes.iter().all(|(_, outcome)| outcome.status.has_results()) {
            0
        } else {
            4
        }
    }
}

/// Works through the shard's drives that have no results yet and writes the table, also when stopped.
///
/// # Errors
/// Files of the directory that cannot be read or written. A failing drive is none.
pub fn run(manifest: &Manifest, options: &Options, monitor: &dyn Monitor) -> Result<Report> {
    for folder in options.folders() {
        fs::create_dir_all(&folder).map_err(|e| Error::write(&folder, e))?;
    }
    let history = History::read(&options.out)?;
    let state = State::open(&options.state_file())?;
    let mine = manifest.drives.iter().enumerate().filter(|(number, _)| options.shard.holds(*number));
    let tasks: Vec<Task<'_>> = mine.map(|(_, drive)| Task::new(drive, options, &history)).collect();
    let kept = |results: bool| {
        tasks.iter().filter(|t| t.kept.as_ref().is_some_and(|o| o.status.has_results() == results)).count()
    };
    monitor.report(&Event::Begin { total: tasks.len(), done: kept(true), failed: kept(false) });
    let outcomes = pool::run(&tasks, options, state, monitor)?;
    let drives: Vec<_> = tasks.iter().map(|task| task.drive).zip(outcomes).collect();
    let tables = summary::write(&drives, options)?;
    Ok(Report { outcomes: drives.into_iter().map(|(drive, o)| (drive.id.clone(), o)).collect(), tables })
}
