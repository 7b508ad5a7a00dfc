//! All frames of a sequence through the object that takes frames.

use std::borrow::Cow;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use motorcade_dataset::{Frame, FrameResult, Sequence};
use motorcade_perception::{MOST_FRAMES, Observations, Perception};

use crate::error::Result;
use crate::motorcade::Motorcade;
use crate::progress::Progress;

/// Called once per frame, after it was pushed; without the frame where it did not read.
pub type FrameCallback<'a> = &'a mut dyn FnMut(&mut Motorcade, Option<&Frame>);

/// Frames that perception may be ahead of the estimator.
const FRAMES_AHEAD: usize = 4;

/// Time between two looks at a request to stop while observations are awaited.
const LOOK_EVERY: Duration = Duration::from_millis(50);

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
    if let Some(fps) = sequence.assumed_fps() {
        slam.warn(format!(
            "nothing tells the frame rate of the pictures: {fps} frames/s are assumed, and speeds are proportional to it; give --fps"
        ));
    }
    for warning in slam.warnings() {
        progress.warn(warning);
    }
    progress.begin("odometry", sequence.known_len());
    let mut perception = slam.take_perception();
    let stop = || progress.cancelled();
    let mut push = |observed: Result<Observed>| -> Result<()> {
        let (frame, observations, ms) = observed?;
        push(slam, &frame, observations, ms, progress)?;
        each(slam, frame.as_ref().ok());
        progress.advance(slam.frames());
        Ok(())
    };
    let mut frames = sequence.frames();
    if threads < 2 {
        while let Some(frame) = frames.next_unless(&stop) {
            push(observe(&mut perception, frame))?;
            if stop() {
                break;
            }
        }
    } else {
        let (sender, receiver) = sync_channel(FRAMES_AHEAD);
        // Not a scoped thread: one that waits for a frame must not keep a stopped run waiting.
        let ahead = std::thread::spawn(move || {
            for frame in frames {
                // The receiver has gone: the run was stopped.
                if sender.send(observe(&mut perception, frame)).is_err() {
                    break;
                }
            }
        });
        while let Some(observed) = next_unless(&receiver, &stop) {
            push(observed)?;
            if stop() {
                break;
            }
        }
        // At the end of the frames the thread has ended too; a panic in it is not the end of the frames.
        if !stop()
            && let Err(panic) = ahead.join()
        {
            std::panic::resume_unwind(panic);
        }
    }
    if stop() {
        slam.interrupt(sequence.known_len());
        return Ok(());
    }
    for problem in sequence.live_problems() {
        progress.warn(&problem);
        slam.warn(problem);
    }
    Ok(())
}

/// Frames looked through for what is fixed to the camera.
const SURVEYED: usize = 150;

/// Looks through the first frames of a sequence for what is fixed to the camera ([`Motorcade::survey`]): for drives that are
/// estimated as a whole.
pub fn survey_sequence(slam: &mut Motorcade, sequence: &Sequence, progress: &dyn Progress) {
    let stop = || progress.cancelled();
    let every = sequence.len().min(SURVEYED).div_ceil(MOST_FRAMES).max(1);
    let mut frames = sequence.frames();
    let mut number = 0;
    let images = std::iter::from_fn(|| {
        while number < SURVEYED && !stop() {
            let frame = frames.next_unless(&stop)?;
            number += 1;
            if let (Ok(frame), true) = (frame, (number - 1).is_multiple_of(every)) {
                return Some(Cow::Owned(frame.gray().into_owned()));
            }
        }
        None
    });
    slam.survey(images);
}

/// The next item, or `None` at the end or as soon as `stop` says so.
fn next_unless<T>(receiver: &Receiver<T>, stop: &dyn Fn() -> bool) -> Option<T> {
    loop {
        match receiver.recv_timeout(LOOK_EVERY) {
            Err(RecvTimeoutError::Timeout) if stop() => return None,
            Err(RecvTimeoutError::Timeout) => {}
            received => return received.ok(),
        }
    }
}

fn observe(perception: &mut Perception, frame: FrameResult) -> Result<Observed> {
    let start = Instant::now();
    let observations = match &frame {
        Ok(frame) => perception.observe(frame)?,
        Err(_) => Observations::default(),
    };
    Ok((frame, observations, start.elapsed().as_secs_f64() * 1e3))
}

fn push(
    slam: &mut Motorcade,
    frame: &FrameResult,
    observations: Observations,
    ms: f64,
    progress: &dyn Progress,
) -> Result<()> {
    match frame {
        Ok(frame) => slam.push_observed(frame, observations, ms),
        Err(bad) => {
            progress.warn(&format!("{bad}; its pose is bridged"));
            slam.skip(bad.number, bad.timestamp_ns, &bad.reason.to_string())
        }
    }
}
