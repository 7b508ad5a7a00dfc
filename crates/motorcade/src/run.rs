//! All frames of a sequence through the object that takes frames.

use std::any::Any;
use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use image::GrayImage;
use motorcade_dataset::{Frame, FrameResult, Frames, Sequence};
use motorcade_perception::{FixedRegionOptions, Observations, Perception};

use crate::error::{Error, Result};
use crate::motorcade::{Motorcade, Resumed};
use crate::progress::Progress;

/// Called once per frame, after it was pushed; without the frame where it did not read.
pub type FrameCallback<'a> = &'a mut dyn FnMut(&mut Motorcade, Option<&Frame>);

/// Frames that perception may be ahead of the estimator.
const FRAMES_AHEAD: usize = 4;

/// Time between two looks at a request to stop while observations are awaited.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// A frame with its observations and the time they took \[ms\].
type Observed = (FrameResult, Observations, f64);

/// What became of a frame in the detectors.
enum Outcome {
    Observed(Observed),
    /// A detector failed on the input.
    Error(Error),
    /// A detector panicked: the program is at fault.
    Panic(String),
}

/// Pushes all frames of a sequence. With `threads` ≥ 2 perception works ahead on a thread of its own; results do not depend
/// on it. A drive that [resumed](Motorcade::resume) goes on after the rows that it has.
///
/// # Errors
/// A detector that fails; a sequence that is not that of the state a drive goes on from. A frame that does not read is bridged and reported as a warning. A detector that panics ends the frames:
/// the result then holds those before, and is marked as failed.
pub fn push_sequence(
    slam: &mut Motorcade,
    sequence: &Sequence,
    threads: usize,
    progress: &dyn Progress,
    each: FrameCallback<'_>,
) -> Result<()> {
    let resumed = slam.take_resumed();
    // The warnings of a drive that goes on hold these already.
    if resumed.is_none() {
        if let Some(fps) = sequence.assumed_fps() {
            slam.warn(format!(
                "the frame rate of the pictures is not given: {fps} frames/s are assumed, and speeds are proportional to it; give --fps"
            ));
        }
        if let Some(problem) = sequence.turned_calibration() {
            slam.warn(problem);
        }
    }
    for warning in slam.warnings() {
        progress.warn(warning);
    }
    progress.begin("odometry", sequence.known_len());
    slam.reserve(sequence.known_len().unwrap_or_default());
    let mut frames = frames_after(sequence, resumed.as_ref())?;
    let mut perception = slam.take_perception();
    let stop = || progress.cancelled();
    let mut push = |outcome: Outcome| -> Result<bool> {
        let (frame, observations, ms) = match outcome {
            Outcome::Observed(observed) => observed,
            Outcome::Error(error) => return Err(error),
            Outcome::Panic(problem) => {
                progress.warn(&problem);
                slam.fail(sequence.known_len(), problem);
                return Ok(false);
            }
        };
        push(slam, &frame, observations, ms, progress)?;
        each(slam, frame.as_ref().ok());
        progress.advance(slam.frames());
        Ok(!stop())
    };
    if threads < 2 {
        while let Some(frame) = frames.next_unless(&stop) {
            if !push(observe(&mut perception, frame))? {
                break;
            }
        }
    } else {
        let (sender, receiver) = sync_channel(FRAMES_AHEAD);
        // Not a scoped thread: one that waits for a frame must not keep a stopped run waiting.
        std::thread::spawn(move || {
            for frame in frames {
                // The receiver has gone: the run was stopped.
                if sender.send(observe(&mut perception, frame)).is_err() {
                    break;
                }
            }
        });
        while let Some(outcome) = next_unless(&receiver, &stop) {
            if !push(outcome)? {
                break;
            }
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

/// The frames after those of an earlier process.
fn frames_after(sequence: &Sequence, resumed: Option<&Resumed>) -> Result<Frames> {
    let Some(resumed) = resumed else { return Ok(sequence.frames()) };
    if !resumed.has_picture() {
        return Ok(sequence.frames_from(resumed.rows));
    }
    let mut frames = sequence.frames_from(resumed.rows.saturating_sub(1));
    let last = frames.next().and_then(FrameResult::ok);
    resumed.check(last.as_ref())?;
    Ok(frames)
}

/// Looks through the first frames of a sequence for what is fixed to the camera ([`Motorcade::survey`]): for drives that are
/// estimated as a whole.
pub fn survey_sequence(slam: &mut Motorcade, sequence: &Sequence, progress: &dyn Progress) {
    let options = slam.settings().config.perception.advanced.fixed;
    slam.survey(surveyed(sequence, &options, progress));
}

/// Pictures from all over the first frames of a sequence; fewer when the progress is cancelled.
pub(crate) fn surveyed<'a>(
    sequence: &Sequence,
    options: &FixedRegionOptions,
    progress: &'a dyn Progress,
) -> impl Iterator<Item = Cow<'static, GrayImage>> + use<'a> {
    let stop = move || progress.cancelled();
    let surveyed = options.surveyed_frames;
    let every = sequence.len().min(surveyed).div_ceil(options.most_frames).max(1);
    let mut frames = sequence.frames();
    let mut number = 0;
    std::iter::from_fn(move || {
        while number < surveyed && !stop() {
            let frame = frames.next_unless(&stop)?;
            number += 1;
            if let (Ok(frame), true) = (frame, (number - 1).is_multiple_of(every)) {
                return Some(Cow::Owned(frame.gray().into_owned()));
            }
        }
        None
    })
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

fn observe(perception: &mut Perception, frame: FrameResult) -> Outcome {
    let start = Instant::now();
    let observations = match &frame {
        // A detector that panicked is not asked again.
        Ok(frame) => match catch_unwind(AssertUnwindSafe(|| perception.observe(frame))) {
            Ok(Ok(observations)) => observations,
            Ok(Err(error)) => return Outcome::Error(error.into()),
            Err(panic) => {
                let number = frame.number;
                return Outcome::Panic(format!(
                    "frame {number}: a fault of the program in its detectors ({}); the results end before this frame",
                    message(&*panic)
                ));
            }
        },
        Err(_) => Observations::default(),
    };
    Outcome::Observed((frame, observations, start.elapsed().as_secs_f64() * 1e3))
}

/// What a panic says.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no reason given")
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
