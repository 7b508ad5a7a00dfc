//! A directory of results: filled beside its place or in it under a temporary name, moved when complete, the record last.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use motorcade_dataset::staging;
use tempfile::TempDir;

use super::listing::{self, ListedFile};
use super::{io_error, output_error};
use crate::error::{Error, Result};

/// Name of the record of a run, which lists its files.
pub const RUN_RECORD: &str = "run.json";

/// A directory that results go to. An earlier result there is replaced only if its record lists every file in it.
#[derive(Debug)]
pub struct OutputDirectory {
    path: PathBuf,
    record: &'static str,
    before: Content,
}

/// Content of the directory.
#[derive(Clone, Debug, PartialEq)]
enum Content {
    Absent,
    Empty,
    /// An earlier result and the bytes of its record.
    Result(Vec<u8>),
}

impl OutputDirectory {
    /// Checks that results can go to `path`, and moves an empty file there and away again. `record` is the name of the file
    /// that lists the others.
    ///
    /// # Errors
    /// A directory that holds something, unless `force` and its record lists all of it; a place that cannot be written.
    pub fn open(path: &Path, record: &'static str, force: bool) -> Result<Self> {
        let own = |problem: String| Err(Error::Config(format!("{}: {problem}", path.display())));
        let before = content(path, record)?;
        if before != Content::Absent && before != Content::Empty && !force {
            return Err(Error::Config(format!(
                "{} is not empty; choose another --out or add --force to replace it",
                path.display()
            )));
        }
        if let Content::Result(bytes) = &before {
            let Some(listed) = listing::listed(bytes) else {
                return own(format!(
                    "only results whose {record} lists their files are replaced, and this directory has none; choose another --out"
                ));
            };
            let foreign = listing::foreign(path, record, &listed).map_err(|e| io_error(path, &e))?;
            if !foreign.is_empty() {
                return own(format!(
                    "only what its {record} lists, name and size, is removed; in the way: {}",
                    some_of(&foreign)
                ));
            }
        }
        let directory = Self { path: path.to_path_buf(), record, before };
        directory.try_move().map_err(|e| io_error(path, &e))?;
        Ok(directory)
    }

    /// Has `fill` write the files into a temporary directory, adds the record that `record` makes of their list, and moves all of
    /// it to its place.
    ///
    /// # Errors
    /// Those of `fill`, and files that cannot be written; nothing is left behind then, and an earlier result stays. When the
    /// last move fails, the error names the directory that holds the results.
    pub fn write<T, E: From<Error>>(
        &self,
        fill: impl FnOnce(&Path) -> Result<T, E>,
        record: impl FnOnce(&[ListedFile], &T) -> serde_json::Value,
    ) -> Result<T, E> {
        let (staging, _lock) = self.stage().map_err(|e| io_error(&self.path, &e))?;
        let new = staging.path().join("new");
        let made = fill(&new)?;
        let written = listing::files(&new).and_then(|files| {
            let text = serde_json::to_string_pretty(&record(&files, &made)).unwrap_or_default();
            fs::write(new.join(self.record), text + "\n")
        });
        written.map_err(|e| io_error(&self.path, &e))?;
        self.commit(staging).map_err(E::from)?;
        Ok(made)
    }

    /// The error of a file in a temporary folder, naming the place it was meant for.
    pub(super) fn in_place(&self, error: Error, folder: &Path) -> Error {
        match error {
            Error::Output { path, reason, full } => {
                let path = path.strip_prefix(folder).map(|name| self.path.join(name)).unwrap_or(path);
                Error::Output { path, reason, full }
            }
            other => other,
        }
    }

    /// A locked temporary directory on the file system of the results, with `new` in it.
    fn stage(&self) -> io::Result<(TempDir, Option<File>)> {
        let folder = if self.path.is_dir() { self.path.clone() } else { parent(&self.path) };
        fs::create_dir_all(&folder)?;
        staging::remove_stale(&folder, |path| path.join("new").join(self.record).exists());
        let made = staging::create(&folder, |builder, at| builder.tempdir_in(at), TempDir::path)?;
        fs::create_dir(made.0.path().join("new"))?;
        Ok(made)
    }

    fn try_move(&self) -> io::Result<()> {
        let (staging, _lock) = self.stage()?;
        let (from, to) = (staging.path().join("empty"), staging.path().with_extension("moved"));
        File::create(&from)?;
        fs::rename(&from, &to)?;
        fs::remove_file(&to)
    }

    fn commit(&self, staging: TempDir) -> Result<()> {
        let problem = match self.moved(&staging.path().join("new"), &staging.path().join("old")) {
            Ok(()) => return Ok(()),
            Err(problem) => problem,
        };
        // A name that is no temporary one: nobody removes it as stale.
        let staged = staging.keep();
        let kept = staged.with_file_name(format!("{}-not-moved-{}", name_of(&self.path), std::process::id()));
        let kept = match fs::rename(staged.join("new"), &kept) {
            Ok(()) => {
                // Best effort: it is empty now.
                let _ = fs::remove_dir_all(&staged);
                kept
            }
            Err(_) => staged.join("new"),
        };
        Err(output_error(&self.path, &format!("{problem}; the results lie in {}", kept.display())))
    }

    /// Moves `new` to its place and what was there to `old`, or says why not.
    fn moved(&self, new: &Path, old: &Path) -> Result<(), String> {
        let _lock = match File::open(&self.path) {
            Ok(directory) if !staging::try_lock(&directory) => {
                return Err("another run is being written there".to_owned());
            }
            other => other.ok(),
        };
        let now = content(&self.path, self.record).map_err(|e| e.to_string())?;
        let mut replaced = Vec::new();
        match &now {
            // The system refuses to move a directory over one that holds something.
            Content::Absent => return fs::rename(new, &self.path).map_err(|e| e.to_string()),
            Content::Empty => {}
            Content::Result(record) => {
                replaced = listing::listed(record).unwrap_or_default();
                let foreign = listing::foreign(&self.path, self.record, &replaced);
                if now != self.before || foreign.is_ok_and(|names| !names.is_empty()) {
                    return Err("something else was written there in the meantime".to_owned());
                }
                // The record goes first: without it nobody takes a half for a result.
                replaced.insert(0, ListedFile { name: self.record.to_owned(), bytes: 0 });
            }
        }
        let mut moves = Moves::default();
        let done = self.move_all(&mut moves, &replaced, new, old);
        done.map_err(|e| {
            moves.undo();
            e.to_string()
        })
    }

    fn move_all(&self, moves: &mut Moves, replaced: &[ListedFile], new: &Path, old: &Path) -> io::Result<()> {
        for file in replaced.iter().filter(|file| self.path.join(&file.name).exists()) {
            moves.rename(&self.path, old, &file.name)?;
        }
        moves.remove_empty_folders(&self.path);
        for file in listing::files(new)?.iter().filter(|file| file.name != self.record) {
            moves.rename(new, &self.path, &file.name)?;
        }
        moves.rename(new, &self.path, self.record)
    }
}

/// Renamed files, to be renamed back when one cannot be.
#[derive(Default)]
struct Moves(Vec<(PathBuf, PathBuf)>);

impl Moves {
    fn rename(&mut self, from: &Path, to: &Path, name: &str) -> io::Result<()> {
        let (from, to) = (from.join(name), to.join(name));
        fs::create_dir_all(parent(&to))?;
        if fs::symlink_metadata(&to).is_ok() {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, format!("{name} is in the way")));
        }
        fs::rename(&from, &to)?;
        self.0.push((from, to));
        Ok(())
    }

    /// Folders below `top` that the files moved so far have left empty.
    fn remove_empty_folders(&self, top: &Path) {
        for (from, _) in &self.0 {
            let folders = from.ancestors().skip(1).take_while(|folder| *folder != top);
            // A folder that still holds something stays.
            folders.for_each(|folder| drop(fs::remove_dir(folder)));
        }
    }

    fn undo(&self) {
        for (from, to) in self.0.iter().rev() {
            // Best effort: the error that matters is the first.
            let _ = fs::create_dir_all(parent(from));
            let _ = fs::rename(to, from);
        }
    }
}

fn content(path: &Path, record: &str) -> Result<Content> {
    match fs::metadata(path) {
        Err(_) if path.is_symlink() => Err(output_error(path, "is a symbolic link to nothing")),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Content::Absent),
        Err(e) => Err(io_error(path, &e)),
        Ok(found) if !found.is_dir() => Err(output_error(path, "is a file, not a directory")),
        Ok(_) => {
            staging::remove_stale(path, |found| found.join("new").join(record).exists());
            let names = fs::read_dir(path)
                .and_then(|entries| entries.map(|e| e.map(|e| e.file_name())).collect::<io::Result<Vec<_>>>())
                .map_err(|e| io_error(path, &e))?;
            // Temporary directories are locked, this process's own among them.
            let foreign = |name: &std::ffi::OsString| {
                name != "lost+found" && !listing::is_checkpoint(name) && !staging::is_staging_name(name)
            };
            if !names.iter().any(foreign) {
                return Ok(Content::Empty);
            }
            Ok(Content::Result(motorcade_dataset::regular_file::read(&path.join(record)).unwrap_or_default()))
        }
    }
}

/// The first names of a list.
fn some_of(names: &[String]) -> String {
    const SHOWN: usize = 10;
    let shown = names.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN { format!("{shown} and {} more", names.len() - SHOWN) } else { shown }
}

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| "results".to_owned(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
#[path = "directory_tests.rs"]
mod tests;
