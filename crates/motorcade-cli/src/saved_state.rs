//! The state of a run beside its checkpoint, from which a resumed run goes on.

use std::time::{Duration, Instant};

use motorcade::{Motorcade, Progress, StateFolder};
use motorcade_perception::Checkpoint;
use motorcade_viewer::Pictures;

use crate::checkpoint::Opened;
use crate::exit;
use crate::progress::Reporter;

/// Writes the state every so often, and takes it up again.
pub struct SavedState {
    folder: StateFolder,
    perception: Checkpoint,
    /// True where a run goes on with the checkpoint of an earlier one.
    resumes: bool,
    every: Duration,
    written: Instant,
    /// True once it could not be written: the run goes on without.
    failed: bool,
}

impl SavedState {
    /// Beside a checkpoint, to be written after this time again and again; `None`, and said, where something else is there.
    pub fn new(checkpoint: &Opened, slam: &mut Motorcade, every: Duration) -> Option<Self> {
        let Opened { perception, state, resumed } = checkpoint;
        if !state.is_free() {
            let path = state.path().display();
            exit::eprint(&format!("warning: {path} is no folder; the run goes on without writing its state"));
            return None;
        }
        slam.put_rows_in(state.path());
        Some(Self {
            folder: state.clone(),
            perception: perception.clone(),
            resumes: *resumed,
            every,
            written: Instant::now(),
            failed: false,
        })
    }

    /// Goes on with the state of the earlier run; false, and said, where there is none that can be used.
    pub fn resume(&mut self, slam: &mut Motorcade, pictures: &mut Pictures) -> bool {
        if !self.resumes {
            return false;
        }
        match self.take(slam, pictures) {
            Ok(false) => {}
            Ok(true) => {
                exit::eprint(&format!(
                    "motorcade: goes on after {} frames, with the state that the stopped run wrote",
                    slam.frames()
                ));
                return true;
            }
            Err(problem) => exit::eprint(&format!(
                "motorcade: the state in {} is not used ({problem:#}); odometry and road are computed from the first frame",
                self.folder.path().display()
            )),
        }
        // Rows that are put away from the first frame on do not belong to it.
        self.folder.clear();
        false
    }

    fn take(&self, slam: &mut Motorcade, pictures: &mut Pictures) -> anyhow::Result<bool> {
        let Some(parts) = self.folder.read()? else { return Ok(false) };
        let [drive, taken] = &parts[..] else { anyhow::bail!("it has {} parts", parts.len()) };
        let taken = postcard::from_bytes(taken)?;
        slam.resume(drive)?;
        *pictures = taken;
        Ok(true)
    }

    /// After a frame: writes the state where it is time to.
    pub fn write_when_due(&mut self, slam: &Motorcade, pictures: &Pictures, reporter: &Reporter) {
        if self.written.elapsed() >= self.every {
            self.write(slam, pictures, reporter);
        }
    }

    /// Writes the state. Where that fails the run goes on, and the state before stays.
    pub fn write(&mut self, slam: &Motorcade, pictures: &Pictures, reporter: &Reporter) {
        if self.failed || slam.frames() == 0 {
            return;
        }
        let start = Instant::now();
        match self.try_write(slam, pictures) {
            Ok(bytes) => tracing::debug!(
                frames = slam.frames(),
                bytes,
                ms = start.elapsed().as_secs_f64() * 1e3,
                "state written"
            ),
            Err(problem) => {
                self.failed = true;
                reporter.warn(&format!(
                    "{}: {problem:#}; the run goes on without writing its state",
                    self.folder.path().display()
                ));
            }
        }
        self.written = Instant::now();
    }

    fn try_write(&self, slam: &Motorcade, pictures: &Pictures) -> anyhow::Result<u64> {
        // The lines of the frames before the state are on the disk before it is.
        self.perception.sync()?;
        self.folder.write(|to| {
            slam.write_state(to)?;
            to.end_part();
            postcard::to_io(pictures, &mut *to)?;
            to.end_part();
            Ok(())
        })
    }
}
