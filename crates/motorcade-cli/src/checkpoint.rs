//! The checkpoint of a run: perception so far, for `--resume`.

use std::path::{Path, PathBuf};

use motorcade::Progress;
use motorcade::output::CHECKPOINT;
use motorcade_perception::{Checkpoint, Identity};

use crate::exit;
use crate::progress::Reporter;

/// The checkpoint of a run into `out`: begun, or gone on with where `resume` says so and there is one. A run goes on without a new one
/// that cannot be written.
///
/// # Errors
/// A checkpoint of another run, or one that another run is writing.
pub fn open(out: &Path, resume: bool, run: Identity) -> anyhow::Result<Option<Checkpoint>> {
    let [inside, beside] = places(out);
    if resume {
        for path in [&inside, &beside] {
            if let Some(checkpoint) = Checkpoint::resume(path, run.clone())? {
                return Ok(Some(checkpoint));
            }
        }
        exit::eprint("motorcade: no checkpoint of an earlier run is there; starting at the first frame");
    }
    let path = if out.is_dir() { inside } else { beside };
    if !resume && path.exists() {
        let name = path.display();
        exit::eprint(&format!(
            "warning: {name} of an unfinished run is replaced; --resume would have gone on with it"
        ));
    }
    match Checkpoint::create(&path, run) {
        Ok(checkpoint) => Ok(Some(checkpoint)),
        Err(error) => {
            exit::eprint(&format!("warning: {error}; the run goes on without a checkpoint"));
            Ok(None)
        }
    }
}

/// After the frames: says how many came from the checkpoint, and why it could not be written.
pub fn report(checkpoint: &Checkpoint, reporter: &Reporter) {
    if let Some(problem) = checkpoint.problem() {
        reporter.warn(&problem);
    }
    if checkpoint.replayed() > 0 {
        exit::eprint(&format!(
            "motorcade: perception of {} frames came from the checkpoint",
            checkpoint.replayed()
        ));
    }
}

/// In the directory of the results where there is one (it may be a mount point), else beside it.
fn places(out: &Path) -> [PathBuf; 2] {
    let name = out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    [out.join(CHECKPOINT), out.with_file_name(format!(".{name}{CHECKPOINT}"))]
}
