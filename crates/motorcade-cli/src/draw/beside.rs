//! The drawings that a run or a demo makes beside its results.

use std::path::{Path, PathBuf};

use motorcade::output::{Extra, OutputDirectory};
use motorcade::{Error, RecordedRun, RunContext, RunResult, write_run_and};
use motorcade_dataset::Sequence;
use motorcade_mcap::Schemas;

use super::drawing::Drawing;
use super::rig::Rig;
use super::target::Target;
use crate::progress::Reporter;

/// Results to be written.
pub struct Results<'a> {
    pub directory: &'a OutputDirectory,
    /// Path of the directory.
    pub out: &'a Path,
    pub result: &'a RunResult,
    pub context: &'a RunContext,
    pub extras: &'a [Extra],
}

/// The frames of a drive and how they are drawn.
pub struct Frames<'a> {
    pub sequence: &'a Sequence,
    pub threads: usize,
    pub schemas: Schemas,
    pub reporter: &'a Reporter,
}

/// The place of a drawing made together with results.
pub enum DrawingTarget {
    /// In the directory of the results, as one of its files of this name.
    Inside(PathBuf),
    /// Anywhere else.
    Elsewhere(Box<Target>),
}

impl DrawingTarget {
    /// Checks the place of a drawing; `out` is the directory of the results.
    ///
    /// # Errors
    /// As [`Target::open`], and a place in a folder of the results.
    pub fn open(path: &Path, out: &Path, force: bool) -> anyhow::Result<Self> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if let (Ok(folder), Ok(out), Some(name)) = (full(parent), full(out), path.file_name()) {
            if folder == out {
                return Ok(Self::Inside(name.into()));
            }
            if folder.starts_with(&out) {
                let problem = "lies in a folder of the results; put it into their directory or elsewhere";
                return Err(Error::Config(format!("{} {problem}", path.display())).into());
            }
        }
        Ok(Self::Elsewhere(Box::new(Target::open(path, force)?)))
    }
}

/// A path without links as far as it exists, else as written.
fn full(path: &Path) -> std::io::Result<PathBuf> {
    path.canonicalize().or_else(|_| std::path::absolute(path))
}

/// Writes results, and the drawings asked for unless the run was stopped. Returns where the drawings are, or why one is missing:
/// the results are safe without it.
///
/// # Errors
/// Results that cannot be written.
pub fn write(
    results: &Results<'_>,
    places: Vec<DrawingTarget>,
    frames: Option<Frames<'_>>,
) -> motorcade::Result<anyhow::Result<Vec<PathBuf>>> {
    let Results { directory, out, result, context, extras } = results;
    let rig = Rig::of(result);
    let mut drawn: anyhow::Result<Vec<PathBuf>> = Ok(Vec::new());
    let (mut inside, mut elsewhere) = (Vec::new(), Vec::new());
    for place in places.into_iter().filter(|_| !result.interrupted) {
        match place {
            DrawingTarget::Inside(name) => inside.push(name),
            DrawingTarget::Elsewhere(target) => elsewhere.push(*target),
        }
    }
    write_run_and(directory, result, context, extras, |folder| {
        for name in &inside {
            let target = Target::open(&folder.join(name), true);
            let made = target.and_then(|target| draw(frames.as_ref(), folder, &rig, target));
            // The folder has a temporary name yet.
            add(&mut drawn, made.map(|path| path.and_then(|p| p.file_name().map(|name| out.join(name)))));
        }
    })?;
    for target in elsewhere {
        add(&mut drawn, draw(frames.as_ref(), out, &rig, target));
    }
    Ok(drawn)
}

fn draw(
    frames: Option<&Frames<'_>>,
    folder: &Path,
    rig: &Rig,
    target: Target,
) -> anyhow::Result<Option<PathBuf>> {
    frames.map(|frames| frames.draw(folder, rig, target)).transpose()
}

/// Adds a drawing to those made; the first failure stays.
fn add(drawn: &mut anyhow::Result<Vec<PathBuf>>, made: anyhow::Result<Option<PathBuf>>) {
    match (drawn.as_mut(), made) {
        (Ok(paths), Ok(path)) => paths.extend(path),
        (Ok(_), Err(error)) => *drawn = Err(error),
        (Err(_), _) => {}
    }
}

impl Frames<'_> {
    /// Draws the run whose tables lie in `folder`.
    pub fn draw(&self, folder: &Path, rig: &Rig, target: Target) -> anyhow::Result<PathBuf> {
        let run = RecordedRun::read(folder)?;
        let drawing = Drawing::new(folder, run, rig, self.sequence, self.threads, self.schemas)?;
        Ok(drawing.write(target, self.reporter)?.path)
    }
}
