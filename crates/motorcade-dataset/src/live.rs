//! A live source that runs, and the selection of its frames.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};
use crate::frame::Pixels;
use crate::options::SequenceOptions;
use crate::selection::FrameRange;
use crate::source::LiveSource;
use crate::source::Slot;
use crate::source::live::{LiveReader, Timed};

/// A live source that runs. Its frames can be taken once.
#[derive(Debug)]
pub(crate) struct Live(Mutex<State>);

#[derive(Debug)]
struct State {
    reader: LiveReader,
    /// The first selected frame, read to know the size.
    first: Option<(u64, Timed)>,
    origin_ns: i64,
    /// Number of the next frame.
    next: u64,
    ended: bool,
    /// Why it ended, where that was a failure.
    failure: Option<String>,
    frames: FrameRange,
    stride: u64,
    fps: Option<f64>,
}

impl Live {
    /// Opens a source and reads its first selected frame.
    ///
    /// # Errors
    /// Options without `live`, a source that does not open or ends before the first selected frame.
    pub(crate) fn open(
        path: &Path,
        source: &LiveSource,
        options: &SequenceOptions,
    ) -> Result<(Self, Pixels)> {
        if !options.live {
            return Err(Error::Usage(format!(
                "{} is a live source, whose frames come once and without a known end: only `motorcade run --online` takes it; elsewhere record \
                 it to a file first",
                path.display()
            )));
        }
        let reader = LiveReader::open(path, source)?;
        let (frames, stride) = (options.frames, options.stride.max(1) as u64);
        let mut state = State {
            reader,
            first: None,
            origin_ns: 0,
            next: 0,
            ended: false,
            failure: None,
            frames,
            stride,
            fps: options.fps,
        };
        let first = state.selected()?.ok_or_else(|| {
            Error::Usage(format!("{} ended before the first frame of {}", path.display(), options.frames))
        })?;
        let pixels = Pixels::Rgb(first.1.0.clone());
        (state.origin_ns, state.first) = (first.1.1, Some(first));
        Ok((Self(Mutex::new(state)), pixels))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next selected frame; `None` at the end. A source that fails is at its end after that.
    pub(crate) fn next(&self) -> Option<(Slot, Result<Pixels>)> {
        self.state().next_slot()
    }

    /// Problems of the source, after the end.
    pub(crate) fn problems(&self) -> Vec<String> {
        let mut state = self.state();
        if !state.ended {
            return Vec::new();
        }
        let failure = state.failure.take();
        failure.into_iter().chain(state.reader.problems()).collect()
    }
}

impl State {
    fn next_slot(&mut self) -> Option<(Slot, Result<Pixels>)> {
        if self.ended {
            return None;
        }
        let found = match self.first.take() {
            Some(first) => Ok(Some(first)),
            None => self.selected(),
        };
        match found {
            Ok(Some((number, (image, time_ns)))) => {
                let timestamp_ns = match self.fps {
                    Some(fps) => (number as f64 * 1e9 / fps).round() as i64,
                    None => time_ns - self.origin_ns,
                };
                Some((Slot { number, timestamp_ns, path: None }, Ok(Pixels::Rgb(image))))
            }
            Ok(None) => {
                self.ended = true;
                None
            }
            Err(error) => {
                self.ended = true;
                self.failure = Some(error.to_string());
                None
            }
        }
    }

    /// The next frame in the range and of the stride, with its number.
    fn selected(&mut self) -> Result<Option<(u64, Timed)>> {
        loop {
            if self.frames.end.is_some_and(|end| self.next >= end) {
                return Ok(None);
            }
            let Some(timed) = self.reader.next()? else { return Ok(None) };
            let number = self.next;
            self.next += 1;
            let after = number.checked_sub(self.frames.start.unwrap_or(0));
            if after.is_some_and(|after| after.is_multiple_of(self.stride)) {
                return Ok(Some((number, timed)));
            }
        }
    }
}
