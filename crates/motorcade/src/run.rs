//! All frames of a sequence through the object that takes frames.

use std::sync::mpsc::sync_channel;
use std::time::Instant;

use motorcade_dataset::{FrameResult, Sequence};
use motorcade_perception::{Observations, Perception};

use crate::error::Result;
use crate::motorcade::Motorcade;
use crate::progress::Progress;

/// Called once per frame, after it was pushed.
pub type FrameCallback<'a> = &'a mut dyn FnMut(&mut Motorcade);

/// Frames that perception may be ahead of the estimator.
const FRAMES_AHEAD: usize = 4;

/// A frame with its observations and the time they took \[ms\].
type Observed = (FrameResult, Observations, f64);

/// Pushes all frames of a sequence. With `threads` ≥ 2 perception works ahead on a thread of its own; results do not depend
/// on it.
///
/// # Errors
/// A detector that fails. A frame that does not read is bridged and reported as a warning.
pub fn push_sequence(
    slam: &mut Motorcade,
    sequence: &Sequence,
    threads: usize,
    progress: &dyn Progress,
    each: FrameCallback<'_>,
) -> Result<()> {
    progress.begin("odometry", Some(sequence.len()));
    let mut perception = slam.take_perception();
    let mut push = |observed: Result<Observed>| -> Result<bool> {
        push(slam, observed?, progress)?;
        each(slam);
        progress.advance(slam.frames());
        let cancelled = progress.cancelled();
        if cancelled {
            slam.interrupt();
        }
        Ok(!cancelled)
    };
    if threads < 2 {
        for frame in sequence.frames() {
            if !push(observe(&mut perception, frame))? {
                break;
            }
        }
        return Ok(());
    }
    std::thread::scope(|scope| {
        let (sender, receiver) = sync_channel(FRAMES_AHEAD);
        scope.spawn(move || {
            for frame in sequence.frames() {
                // The receiver has gone: the run was stopped.
                if sender.send(observe(&mut perception, frame)).is_err() {
                    break;
                }
            }
        });
        for observed in receiver {
            if !push(observed)? {
                break;
            }
        }
        Ok(())
    })
}

fn observe(perception: &mut Perception, frame: FrameResult) -> Result<Observed> {
    let start = Instant::now();
    let observations = match &frame {
        Ok(frame) => perception.observe(frame)?,
        Err(_) => Observations::default(),
    };
    Ok((frame, observations, start.elapsed().as_secs_f64() * 1e3))
}

fn push(slam: &mut Motorcade, (frame, observations, ms): Observed, progress: &dyn Progress) -> Result<()> {
    match frame {
        Ok(frame) => slam.push_observed(&frame, observations, ms),
        Err(bad) => {
            progress.warn(&format!("{bad}; its pose is bridged"));
            slam.skip(bad.number, bad.timestamp_ns, &bad.reason.to_string())
        }
    }
}
