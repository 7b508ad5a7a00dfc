//! The checkpoint of a run: perception so far, and beside it the state, for `--resume`.

use std::path::{Path, PathBuf};

use motorcade::output::CHECKPOINT;
use motorcade::{Progress, StateFolder};
use motorcade_perception::{Checkpoint, Identity};

use crate::exit;
use crate::progress::Reporter;

/// A checkpoint and the folder of the state beside it.
pub struct Opened {
    pub perception: Checkpoint,
    pub state: StateFolder,
    /// True where an earlier run is gone on with.
    pub resumed: bool,
}

impl Opened {
    fn new(path: &Path, run: &Identity, perception: Checkpoint, resumed: bool) -> Self {
        let mut name = path.as_os_str().to_owned();
        name.push(".state");
        let mut run: Vec<String> = run.iter().map(|(name, value)| format!("{name}={value}")).collect();
        run.push(program());
        let state = StateFolder::new(name.into(), run.join("\n"));
        if !resumed {
            state.clear();
        }
        Self { perception, state, resumed }
    }

    /// Removes both: the results are safe.
    pub fn remove(&self) {
        self.state.clear();
        self.perception.remove();
    }
}

/// The checkpoint of a run into `out`: begun, or gone on with where `resume` says so and there is one. A run goes on without a new one
/// that cannot be written.
///
/// # Errors
/// A checkpoint of another run, or one that another run is writing.
pub fn open(out: &Path, resume: bool, run: Identity) -> anyhow::Result<Option<Opened>> {
    let [inside, beside] = places(out, CHECKPOINT);
    if resume {
        for path in [&inside, &beside] {
            if let Some(checkpoint) = Checkpoint::resume(path, run.clone())? {
                return Ok(Some(Opened::new(path, &run, checkpoint, true)));
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
    match Checkpoint::create(&path, run.clone()) {
        Ok(checkpoint) => Ok(Some(Opened::new(&path, &run, checkpoint, false))),
        Err(error) => {
            exit::eprint(&format!("warning: {error}; the run goes on without a checkpoint"));
            Ok(None)
        }
    }
}

/// Size and time of the program's file: another build may keep other fields in a state, or compute other bits.
fn program() -> String {
    let file = std::env::current_exe().and_then(std::fs::metadata);
    let found = file.and_then(|file| Ok((file.len(), file.modified()?)));
    format!("program={:?}", found.ok())
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

/// Places of a file that is no result: in the directory of the results where there is one (it may be a mount point), else beside it.
pub fn places(out: &Path, name: &str) -> [PathBuf; 2] {
    let results = out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    [out.join(name), out.with_file_name(format!(".{results}{name}"))]
}
