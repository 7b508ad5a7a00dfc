//! `motorcade draw`: estimates of a run in the frames of its drive, as a video, pictures or a recording.

mod beside;
mod drawing;
mod frames;
mod recording;
mod rig;
mod scenes;
mod target;
mod video;

use motorcade::{RecordedRun, RunRecord};

pub use self::beside::{DrawingTarget, Frames, Results, write};
pub use self::rig::Rig;
#[cfg(feature = "rerun")]
pub use self::target::free;
pub use self::target::{Target, is_recording};

use self::drawing::Drawing;

use crate::arguments::DrawArguments;
use crate::exit;
use crate::files::all_different;
use crate::progress::Reporter;
use crate::threads::threads;

/// Draws a run.
pub fn draw(arguments: &DrawArguments) -> anyhow::Result<u8> {
    let record = RunRecord::read(&arguments.run)?;
    let (input, out) = (frames::place(&record, arguments), arguments.out.as_path());
    all_different(input.iter().map(|input| ("the input", input.as_path())).chain([("--out", out)]))?;
    let run = RecordedRun::read(&arguments.run)?;
    let sequence = frames::open(&record, &run, arguments)?;
    let Some(rig) = Rig::recorded(&record) else {
        let problem = "its run.json states no height of the camera";
        return Err(motorcade::Error::Input(format!("{}: {problem}", arguments.run.display())).into());
    };
    let target = Target::open(&arguments.out, arguments.force)?;
    let reporter = Reporter::new(arguments.progress);
    let (threads, schemas) = (threads(arguments.threads), arguments.mcap_schemas.into());
    let drawing = Drawing::new(&arguments.run, run, &rig, &sequence, threads, schemas)?;
    let drawn = drawing.write(target, &reporter)?;
    exit::say(&format!("{} frames drawn\n{}", drawn.frames, drawn.path.display()));
    Ok(exit::FINE)
}
