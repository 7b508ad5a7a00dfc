//! The table of vehicles of an online run while it goes on.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use motorcade::output::{GROWING_TRACKS, TrackTable};
use motorcade::{Estimate, Progress};
use motorcade_dataset::staging;

use crate::checkpoint;
use crate::exit;
use crate::progress::Reporter;

/// A file with the columns of `tracks.csv` that has the vehicles of each frame as soon as they are estimated; a run that is killed leaves it.
pub struct GrowingTracks {
    path: PathBuf,
    /// True where the rows of an earlier run are gone on with.
    resumes: bool,
    table: Table,
}

enum Table {
    /// Before the first frame.
    Waiting,
    Open(Box<TrackTable<File>>),
    /// The run goes on without.
    Failed,
}

impl GrowingTracks {
    /// For results in `out`: in that directory where it is there, else beside it. Nothing is written before the first frame.
    pub fn new(out: &Path, resumes: bool) -> Self {
        let [inside, beside] = checkpoint::places(out, &format!("{GROWING_TRACKS}.csv"));
        Self { path: if out.is_dir() { inside } else { beside }, resumes, table: Table::Waiting }
    }

    /// Adds the vehicles of the newest frame. Where that fails the run goes on without the table.
    pub fn push(&mut self, estimate: &Estimate, reporter: &Reporter) {
        if let Err(error) = self.try_push(estimate) {
            let path = self.path.display();
            reporter.warn(&format!("{path}: {error}; the run goes on without this table of its vehicles"));
            self.table = Table::Failed;
        }
    }

    fn try_push(&mut self, estimate: &Estimate) -> io::Result<()> {
        if matches!(self.table, Table::Waiting) {
            self.table = Table::Open(Box::new(self.open(estimate.frame.number)?));
        }
        if let Table::Open(table) = &mut self.table { estimate.add_to(table) } else { Ok(()) }
    }

    /// The table before the rows of a frame. Its file is locked while the run goes on.
    fn open(&self, frame: u64) -> io::Result<TrackTable<File>> {
        let found = match fs::symlink_metadata(&self.path) {
            Ok(found) if !found.is_file() => return Err(io::Error::other("is no regular file")),
            other => other.is_ok(),
        };
        if found {
            let file = locked(OpenOptions::new().read(true).write(true).open(&self.path)?)?;
            let table = if self.resumes { TrackTable::go_on(file, frame)? } else { None };
            if let Some(table) = table {
                return Ok(table);
            }
            self.put_aside()?;
        }
        TrackTable::new(locked(OpenOptions::new().write(true).create_new(true).open(&self.path)?)?)
    }

    /// Renames what an earlier run left: rows that nothing else may hold.
    fn put_aside(&self) -> io::Result<()> {
        let free = |n: &u32| !self.aside(*n).exists();
        let aside = self.aside((1..).find(free).unwrap_or(u32::MAX));
        fs::rename(&self.path, &aside)?;
        exit::eprint(&format!(
            "motorcade: vehicles of an unfinished online run are kept in {}",
            aside.display()
        ));
        Ok(())
    }

    fn aside(&self, n: u32) -> PathBuf {
        self.path.with_extension(format!("{n}.csv"))
    }

    /// Removes the table: the results are safe.
    pub fn remove(self) {
        if let Table::Open(table) = self.table {
            drop(table);
            // Best effort: a table that stays is put aside by the next run.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn locked(file: File) -> io::Result<File> {
    if staging::try_lock(&file) { Ok(file) } else { Err(io::Error::other("is written by another run")) }
}
