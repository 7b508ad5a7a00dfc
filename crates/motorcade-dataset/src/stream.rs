//! Iteration over frames, decoded ahead on a thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::frame::{BadFrame, Frame, Pixels};
use crate::input::Input;
use crate::source::{Slot, Store, decode, video::VideoReader};

/// Item of a sequence.
pub type FrameResult = std::result::Result<Frame, BadFrame>;

/// Iterator over the frames of a [`Sequence`](crate::Sequence). Dropping it stops the decoding.
pub struct Frames {
    source: Source,
    /// Frames that are still to come; `None` where nobody knows.
    left: Option<usize>,
}

enum Source {
    Ahead(Receiver<FrameResult>),
    Inline(Box<Decoder>),
}

impl Frames {
    pub(crate) fn start(decoder: Decoder, prefetch: usize) -> Self {
        let left =
            decoder.input.live.is_none().then(|| decoder.input.slots.len().saturating_sub(decoder.next));
        if prefetch == 0 {
            return Self { source: Source::Inline(Box::new(decoder)), left };
        }
        let spare = Decoder::new(Arc::clone(&decoder.input), decoder.next);
        let (sender, receiver) = sync_channel(prefetch);
        let thread = std::thread::Builder::new().name("motorcade-decode".into());
        let started = thread.spawn(move || {
            for frame in decoder {
                // The receiver was dropped.
                if sender.send(frame).is_err() {
                    break;
                }
            }
        });
        // Without a thread, frames are decoded on demand.
        let source = if started.is_ok() { Source::Ahead(receiver) } else { Source::Inline(Box::new(spare)) };
        Self { source, left }
    }
}

/// Time between two looks at a request to stop while a frame is awaited.
const LOOK_EVERY: Duration = Duration::from_millis(50);

impl Frames {
    /// The next frame, or `None` as soon as `stop` says so: decoding may wait for a disk, a network or another program.
    pub fn next_unless(&mut self, stop: &dyn Fn() -> bool) -> Option<FrameResult> {
        if let Source::Ahead(receiver) = &self.source {
            loop {
                match receiver.recv_timeout(LOOK_EVERY) {
                    Err(RecvTimeoutError::Timeout) if stop() => return None,
                    Err(RecvTimeoutError::Timeout) => {}
                    received => return self.counted(received.ok()),
                }
            }
        }
        self.next()
    }

    fn counted(&mut self, item: Option<FrameResult>) -> Option<FrameResult> {
        self.left = self.left.map(|left| if item.is_some() { left.saturating_sub(1) } else { 0 });
        item
    }
}

impl Iterator for Frames {
    type Item = FrameResult;
    fn next(&mut self) -> Option<FrameResult> {
        let item = match &mut self.source {
            Source::Ahead(receiver) => receiver.recv().ok(),
            Source::Inline(decoder) => decoder.next(),
        };
        self.counted(item)
    }
    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left.unwrap_or(0), self.left)
    }
}

/// Decoder on the calling thread.
pub(crate) struct Decoder {
    input: Arc<Input>,
    next: usize,
    video: Option<VideoReader>,
}

impl Decoder {
    /// Begins with the frame of this row.
    pub(crate) fn new(input: Arc<Input>, row: usize) -> Self {
        Self { input, next: row, video: None }
    }

    fn raw(&mut self, slot: &Slot) -> Result<Pixels> {
        let pixels = match (&self.input.survey.contents.store, &slot.path) {
            (Store::Video(path), _) => {
                let reader = match self.video.take() {
                    Some(reader) => reader,
                    None => VideoReader::open(path, Some(self.input.size))?,
                };
                Pixels::Rgb(self.video.insert(reader).frame(path, slot.number)?)
            }
            (Store::Files, Some(path)) => decode::read(path)?,
            (Store::Files | Store::Live(_), _) => {
                return Err(Error::input(&self.input.survey.root, "is missing this number".to_owned()));
            }
        };
        Ok(pixels)
    }

    fn of_one_size(&self, slot: &Slot, pixels: Pixels) -> Result<Pixels> {
        let ((found_width, found_height), (width, height)) = (pixels.size(), self.input.size);
        if (found_width, found_height) == (width, height) {
            return Ok(pixels);
        }
        Err(Error::Size {
            path: slot.path.clone().unwrap_or_else(|| self.input.survey.root.clone()),
            what: "the frame",
            found_width,
            found_height,
            against: "the first frame",
            width,
            height,
            advice: "all frames of a drive must have one size",
        })
    }

    /// A frame; a panic of a decoder is an error of its frame.
    fn frame_or_fault(&mut self, index: usize, slot: &Slot) -> Result<Frame> {
        let decoded = catch_unwind(AssertUnwindSafe(|| self.frame(index, slot)));
        decoded.unwrap_or_else(|_| {
            let path = slot.path.as_deref().unwrap_or(&self.input.survey.root);
            Err(Error::input(path, "its decoding failed by a fault of the program"))
        })
    }

    fn frame(&mut self, index: usize, slot: &Slot) -> Result<Frame> {
        let raw = self.raw(slot)?;
        self.finished(index, slot, raw)
    }

    /// A frame of raw pixels: masked and undistorted.
    fn finished(&self, index: usize, slot: &Slot, raw: Pixels) -> Result<Frame> {
        let raw = self.of_one_size(slot, raw)?;
        let masks = self.input.masks.as_ref();
        let mask = masks.map_or(Ok(None), |masks| masks.get(slot.number, raw.size()))?;
        let (pixels, ignore) = match &self.input.undistortion {
            Some(table) => (table.pixels(&raw), table.mask(mask.as_ref())),
            None => (raw, mask),
        };
        Ok(Frame { index, number: slot.number, timestamp_ns: slot.timestamp_ns, pixels, ignore })
    }
}

impl Iterator for Decoder {
    type Item = FrameResult;
    fn next(&mut self) -> Option<FrameResult> {
        let index = self.next;
        let (slot, live) = match &self.input.live {
            Some(live) => {
                let (slot, pixels) = live.next()?;
                (slot, Some(pixels))
            }
            None => (self.input.slots.get(index)?.clone(), None),
        };
        self.next += 1;
        let frame = match live {
            Some(pixels) => pixels.and_then(|pixels| self.finished(index, &slot, pixels)),
            None => self.frame_or_fault(index, &slot),
        };
        Some(frame.map_err(|reason| BadFrame {
            index,
            number: slot.number,
            timestamp_ns: slot.timestamp_ns,
            path: slot.path,
            reason,
        }))
    }
}
